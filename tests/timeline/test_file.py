import builtins

import pytest

from riseg_drake.timeline.file import TimelineError, check_timeline, timeline_stream
from tests.timeline.read_back import rows


def test_a_time_line_holds_its_layout_and_name_and_replaces_an_earlier_one(tmp_path):
    from rerun.chunk import RrdReader

    file = tmp_path / "new" / "a.rrd"
    for number in range(2):
        with timeline_stream(file, "name of it", live=False) as stream:
            stream.set_time("time", duration=float(number))
            import rerun

            stream.log("a", rerun.Scalars(number))
        check_timeline(file)
    assert [(t, c["scalars"]) for t, c in rows(file)["a"]] == [(1.0, [1.0])]
    assert len(RrdReader(str(file)).blueprints()) == 1
    assert "name of it" in str(rows(file)["__properties"])


def test_a_file_of_another_kind_is_left_alone(tmp_path):
    for name, said in (
        ("thesis.tex", "end in .rrd"),
        ("thesis.rrd", "another kind"),
        ("folder.rrd", "a folder"),
    ):
        file = tmp_path / name
        file.mkdir() if name.startswith("folder") else file.write_text("years of work")
        with pytest.raises(TimelineError, match=said):
            check_timeline(file)


def test_without_rerun_the_line_says_how_to_get_it(tmp_path, monkeypatch):
    real = builtins.__import__

    def without(name, *others):
        if name == "rerun":
            raise ImportError("No module named 'rerun'")
        return real(name, *others)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(TimelineError, match=r"pip install 'riseg-drake\[rerun\]'"):
        check_timeline(tmp_path / "a.rrd")


def test_a_place_that_cannot_be_written_is_said_at_once(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"), timeline_stream(tmp_path / "file" / "a.rrd", "a", live=False):
        pass
