"""Which file is a bag, and what is said of one that is none or goes wrong while it is read."""

import sys

import numpy as np
import pytest

from riseg_drake.recording import bag_file
from riseg_drake.recording.bag_file import EXTRA, METADATA, bag_in, opened_bag
from riseg_drake.recording.bag_messages import BagMessages
from riseg_drake.recording.layout import RecordingError


def test_a_folder_with_metadata_is_a_bag_itself_whatever_it_holds(tmp_path):
    for name in (METADATA, "a.db3", "b.db3"):
        (tmp_path / name).touch()
    assert bag_in(tmp_path) == tmp_path


@pytest.mark.parametrize("name", ["a.bag", "a.db3", "a.mcap"])
def test_a_folder_holds_a_bag_where_a_single_file_has_messages(tmp_path, name):
    (tmp_path / "a.txt").touch()
    (tmp_path / "folder.bag").mkdir()
    assert bag_in(tmp_path) is None
    (tmp_path / name).touch()
    assert bag_in(tmp_path) == tmp_path / name


def test_two_bags_are_a_question_and_of_more_five_are_named(tmp_path):
    for number in range(2):
        (tmp_path / f"{number}.mcap").touch()
    with pytest.raises(RecordingError, match=r"several bags .*\(0.mcap, 1.mcap\)"):
        bag_in(tmp_path)
    for number in range(2, 6):
        (tmp_path / f"{number}.mcap").touch()
    with pytest.raises(RecordingError, match=r"several bags .*\(0.mcap, 1.mcap, 2.mcap, 3.mcap, 4.mcap\)"):
        bag_in(tmp_path)


def test_without_the_library_it_is_said_how_to_have_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(RecordingError) as error, opened_bag(tmp_path / "a.bag"):
        pass
    assert str(error.value) == f"{tmp_path / 'a.bag'} is a bag, which needs rosbags: {EXTRA}"


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A folder of ROS 2 with one message."""
    pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'riseg-drake[bags]'")
    from tests.recording.made_bags import BagKind, BagWriter

    with BagWriter(tmp_path_factory.mktemp("bags") / "bag", BagKind()) as writer:
        writer.transform("/tf", 10**9, "world", "eye", np.eye(4))
    return writer.path


def test_a_bag_of_ros_is_its_messages(bag):
    with opened_bag(bag) as messages:
        assert type(messages) is BagMessages
        assert messages.path == bag
        assert messages.types == {"/tf": "TFMessage"}


@pytest.mark.parametrize(
    ("raised", "says"),
    [
        (RecordingError("as it is"), "^as it is$"),
        (MemoryError(), "cannot be read: a part of it is larger than memory"),
        (ValueError("the first line\nand the second"), r"is no bag that can be read \(the first line\)$"),
        (KeyError(), r"is no bag that can be read \(KeyError\)$"),
    ],
)
def test_what_goes_wrong_while_a_bag_is_read_is_said_in_one_line(bag, raised, says):
    with pytest.raises(RecordingError, match=says), opened_bag(bag):
        raise raised


def test_a_file_of_ros_1_must_begin_as_one(tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'riseg-drake[bags]'")
    path = tmp_path / "a.bag"
    for content in (b"", b"#ROSBAG V2.0", b" #ROSBAG V2.0\n"):
        path.write_bytes(content)
        with pytest.raises(RecordingError, match="it does not begin as one of ROS 1"):
            bag_file._check_files(path)
    path.write_bytes(b"#ROSBAG V2.0\n and so on")
    bag_file._check_files(path)
    # Others have no such line.
    (tmp_path / "a.mcap").touch()
    bag_file._check_files(tmp_path / "a.mcap")
