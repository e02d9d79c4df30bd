"""Which reader a path is given to."""

import pytest

from riseg_drake.recording import source_kinds
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.source import SourceOptions
from riseg_drake.recording.source_kinds import opened_source

OPTIONS = SourceOptions(stamp_limit=0.5)


@pytest.fixture(autouse=True)
def readers(monkeypatch):
    """Readers that say which one is asked, for what."""
    monkeypatch.setattr(source_kinds, "BagReader", lambda path, options: ("bag", path, options))
    monkeypatch.setattr(source_kinds, "RecordingReader", lambda path, *, options: ("folder", path, options))


@pytest.mark.parametrize("name", ["a.bag", "a.db3", "a.mcap"])
def test_a_file_of_messages_is_a_bag_alone_or_in_a_folder(tmp_path, name):
    (tmp_path / name).touch()
    assert opened_source(tmp_path / name, OPTIONS) == ("bag", tmp_path / name, OPTIONS)
    assert opened_source(tmp_path, OPTIONS) == ("bag", tmp_path / name, OPTIONS)


def test_a_folder_of_lists_is_one_whatever_else_is_in_it(tmp_path):
    (tmp_path / "a.bag").touch()
    (tmp_path / "rgb.txt").symlink_to(tmp_path / "nowhere")
    assert opened_source(tmp_path, OPTIONS) == ("folder", tmp_path, OPTIONS)


def test_a_folder_without_a_bag_and_a_path_that_is_not_there_are_for_the_reader_of_folders_to_judge(tmp_path):
    assert opened_source(tmp_path, OPTIONS) == ("folder", tmp_path, OPTIONS)
    assert opened_source(tmp_path / "nowhere.bag", OPTIONS) == ("folder", tmp_path / "nowhere.bag", OPTIONS)


def test_another_file_is_neither(tmp_path):
    (tmp_path / "a.zip").touch()
    with pytest.raises(RecordingError, match=r"a.zip is not a folder with rgb.txt, and no bag \(.bag, .db3"):
        opened_source(tmp_path / "a.zip", OPTIONS)
