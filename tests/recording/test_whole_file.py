"""Files are whole or not there, and nobody else's are written to."""

import os
import threading

import pytest

from riseg_drake.recording.whole_file import GrowingText, write_bytes


@pytest.mark.parametrize(
    ("name", "kind"), [("a.json", "link"), (".a.json.unfinished", "link"), (".a.json.unfinished", "pipe")]
)
def test_nothing_is_written_through_what_lies_in_the_place_of_a_file(tmp_path, name, kind):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    if kind == "link":
        (tmp_path / name).symlink_to(victim)
    else:
        os.mkfifo(tmp_path / name)
    write_bytes(tmp_path / "a.json", b"new")
    assert (tmp_path / "a.json").read_bytes() == b"new"
    assert not (tmp_path / "a.json").is_symlink()
    assert victim.read_text() == "precious"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json", "victim"]


def test_a_list_that_grows_begins_anew_in_the_place_of_a_link(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    (tmp_path / "list.txt").symlink_to(victim)
    text = GrowingText(tmp_path / "list.txt")
    text.append("one")
    text.close()
    assert (tmp_path / "list.txt").read_text() == "one\n"
    assert victim.read_text() == "precious"


def test_whoever_reads_a_pipe_gets_the_content_and_the_pipe_stays_one(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    heard = []
    reader = threading.Thread(target=lambda: heard.append(pipe.read_bytes()))
    reader.start()
    write_bytes(pipe, b"content")
    reader.join(10)
    assert heard == [b"content"]
    assert pipe.is_fifo()


def test_a_new_file_has_the_permissions_that_any_program_gives(tmp_path):
    write_bytes(tmp_path / "ours", b"")
    (tmp_path / "theirs").write_bytes(b"")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "theirs").stat().st_mode
