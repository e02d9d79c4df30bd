"""A command writes into a folder that is new, empty or its own, alone, and removes what it may and no more."""

import errno
import json
import shutil

import numpy as np
import pytest

from riseg_drake.app import output
from riseg_drake.app.cli import main
from riseg_drake.app.output import RunFolder
from riseg_drake.app.output_folder import OutputError, OutputFolder
from riseg_drake.app.segment.folder import SegmentFolder
from riseg_drake.pictures.video import VideoWriter
from riseg_drake.recording import whole_file
from riseg_drake.recording.whole_file import GrowingText
from tests.app.test_output import step
from tests.recording.made_recordings import drawn_frames, write


def finished(folder, command="run", **about):
    """What an earlier command has left."""
    with RunFolder(folder, about, command=command) as earlier:
        earlier.write_step(step(0))
        earlier.write_step(step(1))
        (folder / "recording").mkdir()
        earlier.note(state="done")


def content(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_a_finished_run_is_not_overwritten_and_what_overwriting_would_remove_is_said(tmp_path):
    finished(tmp_path)
    before = content(tmp_path)
    with pytest.raises(OutputError, match=r"an earlier run \(finished\)") as error:
        RunFolder(tmp_path, {})
    assert "--overwrite to remove its summary.json, recording, step_0 to step_1" in str(error.value)
    assert content(tmp_path) == before
    assert (tmp_path / "recording").is_dir()


@pytest.mark.parametrize(
    ("state", "said"),
    [("interrupted", "stopped"), ("running", "cut off"), ("failed", "failed"), (3, "damaged")],
)
def test_what_was_stopped_is_not_overwritten_either(tmp_path, state, said):
    finished(tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    (tmp_path / "summary.json").write_text(json.dumps({**summary, "state": state}))
    with pytest.raises(OutputError, match=rf"\({said}\)"):
        RunFolder(tmp_path, {})


@pytest.mark.parametrize("command", ["hardware", "segment", "evaluate"])
def test_a_folder_of_another_command_is_left_alone_even_if_overwriting_is_asked_for(tmp_path, command):
    finished(tmp_path, command)
    before = content(tmp_path)
    with pytest.raises(OutputError, match="is not empty and holds no earlier run"):
        RunFolder(tmp_path, {}, overwrite=True)
    assert content(tmp_path) == before


@pytest.mark.parametrize(
    "left", ['{"step": 3}', "[]", "", "{", "[" * 10**5], ids=["theirs", "list", "empty", "half", "deep"]
)
def test_a_summary_of_another_program_is_no_mark(tmp_path, left):
    (tmp_path / "recording").mkdir()
    (tmp_path / "summary.json").write_text(left)
    for claim in (
        lambda: RunFolder(tmp_path, {}, overwrite=True),
        lambda: SegmentFolder(tmp_path, 1.0, {}, overwrite=True),
    ):
        with pytest.raises(OutputError, match="holds no earlier"):
            claim()
    assert (tmp_path / "recording").is_dir()


def test_steps_without_a_summary_are_no_mark(tmp_path):
    (tmp_path / "step_0").mkdir()
    with pytest.raises(OutputError, match="holds no earlier run"):
        RunFolder(tmp_path, {}, overwrite=True)
    assert (tmp_path / "step_0").is_dir()


def test_the_mark_is_there_at_any_moment_of_clearing_up(tmp_path, monkeypatch):
    finished(tmp_path)

    def stop(path):
        raise KeyboardInterrupt

    monkeypatch.setattr(shutil, "rmtree", stop)
    with pytest.raises(KeyboardInterrupt):
        RunFolder(tmp_path, {}, overwrite=True)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["command"], summary["state"], summary.get("steps")) == ("run", "running", [])


def test_a_link_in_the_place_of_a_step_is_removed_and_not_what_it_leads_to(tmp_path):
    finished(tmp_path / "run")
    (tmp_path / "mine").mkdir()
    shutil.rmtree(tmp_path / "run" / "recording")
    (tmp_path / "run" / "recording").symlink_to(tmp_path / "mine")
    RunFolder(tmp_path / "run", {}, overwrite=True)
    assert (tmp_path / "mine").is_dir()
    assert not (tmp_path / "run" / "recording").is_symlink()


def test_two_commands_in_one_folder_are_one_too_many(tmp_path, monkeypatch):
    monkeypatch.setattr("riseg_drake.app.output_folder.PATIENCE", 0.0)
    first = RunFolder(tmp_path, {})
    for claim in (lambda: RunFolder(tmp_path, {}, overwrite=True), lambda: SegmentFolder(tmp_path, 1.0, {})):
        with pytest.raises(OutputError, match="another riseg is writing to"):
            claim()
    first.note(state="done")
    del first  # as the end of a process does
    RunFolder(tmp_path, {}, overwrite=True)


def test_what_may_be_gone_on_with_is_kept(tmp_path):
    def claim(reason):
        return OutputFolder(tmp_path, "evaluate", r"scene_\d+", {"state": "running"}, goes_on=lambda _: reason)

    claim("").close()
    (tmp_path / "scene_000").mkdir()
    claim("").close()
    assert (tmp_path / "scene_000").is_dir()
    with pytest.raises(OutputError, match="holds another evaluation, of other seeds"):
        claim("of other seeds")


def full_disk(room):
    """Stands in for the operating system's write: there is room for so many bytes."""
    left = [room]

    def write_some(data):
        if not left[0]:
            raise OSError(errno.ENOSPC, "No space left on device")
        taken = min(left[0], len(data))
        left[0] -= taken
        return taken

    return write_some


def test_a_step_that_finds_no_room_is_one_line_and_leaves_nothing(tmp_path, monkeypatch):
    folder = RunFolder(tmp_path, {})
    folder.write_step(step(0))

    def no_room(path, image):
        if path.name == "mask.png":
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        whole_file.write_png(path, image)

    monkeypatch.setattr(output, "write_png", no_room)
    with pytest.raises(OutputError, match=r"cannot write to .*mask\.png: No space left on device"):
        folder.write_step(step(1))
    assert {path.name for path in tmp_path.iterdir()} == {"step_0", "summary.json"}
    assert [entry["step"] for entry in json.loads((tmp_path / "summary.json").read_text())["steps"]] == [0]


def test_a_line_that_finds_no_room_is_not_there_and_the_lines_before_are(tmp_path):
    text = GrowingText(tmp_path / "list.txt")
    text.append("0.1 rgb/1.png")

    class Full:
        """The file on a disk with room for five bytes."""

        def __init__(self, file):
            self._file, self._some = file, full_disk(5)
            self.tell, self.truncate = file.tell, file.truncate

        def write(self, data):
            return self._file.write(data[: self._some(data)])

    text._file = Full(text._file)
    with pytest.raises(OSError, match=r"No space left on device: .*list\.txt"):
        text.append("0.2 rgb/2.png")
    assert (tmp_path / "list.txt").read_text() == "0.1 rgb/1.png\n"


def test_a_place_where_nothing_can_be_written_is_named(tmp_path, capsys):
    recording = write(tmp_path / "recording", drawn_frames(1))
    assert main(["segment", str(recording), "--output", "/proc/nowhere/out"]) == 2
    assert capsys.readouterr().err.startswith("riseg: cannot write to /proc/nowhere: ")


def test_a_video_that_is_not_whole_ends_a_segmentation_instead_of_being_left_out(tmp_path, monkeypatch):
    with SegmentFolder(tmp_path / "out", 10.0, {}) as folder:
        color, mask = np.zeros((20, 30, 3), np.uint8), np.zeros((20, 30), np.uint16)
        folder.write("1.png", color, mask, {}, None, 0.0, 1.0)
        # What an encoder leaves of it where there is no room for more.
        video = tmp_path / "out" / ".overlay.unfinished.mp4"
        close = VideoWriter.close

        def cut(self):
            close(self)
            video.write_bytes(video.read_bytes()[:40])

        monkeypatch.setattr(VideoWriter, "close", cut)
        with pytest.raises(OutputError, match=r"overlay\.mp4: it could not be written whole: No space left"):
            folder.finish()
    assert not list((tmp_path / "out").glob("*.mp4"))
    assert not video.exists()
