"""Files that somebody else made: what is no file of a size that can be is refused at once."""

import os

import pytest

from riseg_drake.host.files import FileError, LeadsOutError, MissingFileError, is_file, read_bytes, read_text


def test_a_file_is_read_and_the_mark_that_editors_begin_with_is_left_out(tmp_path):
    (tmp_path / "a").write_bytes(b"\xef\xbb\xbf1 2\n")
    assert read_text(tmp_path / "a") == "1 2\n"
    assert read_bytes(tmp_path / "a", 7, first=3) == b"\xef\xbb\xbf"


def test_a_pipe_a_folder_and_a_device_are_no_files_and_hang_nobody(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, kind in ((tmp_path / "pipe", "a pipe"), (tmp_path, "a folder"), ("/dev/zero", "a device")):
        (tmp_path / "link").unlink(missing_ok=True)
        (tmp_path / "link").symlink_to(path)
        with pytest.raises(FileError, match=f"link is {kind}, not a file"):
            read_bytes(tmp_path / "link", 100)
        assert not is_file(tmp_path / "link")


def test_a_larger_file_is_not_read_to_its_end(tmp_path):
    with (tmp_path / "large").open("wb") as file:
        file.truncate(2**40)  # more than any memory, in no room on the disk
    with pytest.raises(FileError, match="larger than 1 MB"):
        read_bytes(tmp_path / "large", 2**20)


@pytest.mark.parametrize("name", ["a" * 5000, "a\0b", "loop"])
def test_a_name_that_cannot_be_is_an_unreadable_file(tmp_path, name):
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(FileError):
        read_bytes(tmp_path / name, 100, inside=tmp_path)
    assert not is_file(tmp_path / name)
    with pytest.raises(MissingFileError):
        read_bytes(tmp_path / "nowhere", 100)


def test_what_leads_out_of_a_folder_is_refused_only_there(tmp_path):
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret").write_text("mine")
    (inside / "link").symlink_to(tmp_path / "secret")
    (inside / "own").write_text("1")
    (inside / "near").symlink_to("own")
    for path in (inside / "link", inside / ".." / "secret", tmp_path / "secret"):
        with pytest.raises(LeadsOutError, match="leads out of"):
            read_bytes(path, 100, inside)
        assert read_bytes(path, 100) == b"mine"
    assert read_bytes(inside / "near", 100, inside) == b"1"
