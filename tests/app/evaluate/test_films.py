"""`riseg evaluate --suite films`, made small."""

import json

import numpy as np
import pytest

from riseg_drake.app.cli import main
from riseg_drake.app.evaluate import films
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.stations.still_film import StillFilmParameters, still_film

pytestmark = pytest.mark.renders


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The suite with two films of three frames, and one of its own films as a recording."""
    out = tmp_path_factory.mktemp("films")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(films, "FILMS", 2)
        patch.setattr(films, "StillFilmParameters", lambda: StillFilmParameters(frames=3))
        assert main(["evaluate", "--suite", "films", "--seed", "5", "--output", str(out / "own")]) == 0
        recording = out / "own" / "film_005" / "recording"
        more = ["--recordings", str(recording), "--output", str(out / "more")]
        assert main(["evaluate", "--suite", "films", "--seed", "5", *more]) == 0
    return out


def test_each_film_has_its_row_and_the_recordings_too(folder) -> None:
    summary = json.loads((folder / "more" / "summary.json").read_text())
    later = ["recording, from frame 1", "recording, from frame 2"]
    assert list(summary["films"]) == ["still scene, seed 5", "still scene, seed 6", "recording", *later]
    assert [row["frames"] + row["without_table"] for row in summary["films"].values()] == [3, 3, 3, 2, 1]
    masks = (folder / "more" / "recording" / "from_2" / "mask").iterdir()
    assert [mask.name for mask in masks] == ["000002.png"]
    report = (folder / "more" / "films.md").read_text()
    assert "| ten still scenes | 6 |" in report
    assert "| | simulated | recording |" in report


def test_a_film_is_the_same_for_the_same_seed_and_its_poses_err(folder) -> None:
    recorded = list(RecordingReader(folder / "own" / "film_006" / "recording"))
    again = list(still_film(StillFilmParameters(frames=3), 6))
    exact = list(still_film(StillFilmParameters(frames=3, pose_turn_std=0, pose_shift_std=0), 6))
    for a, b, c in zip(recorded, again, exact, strict=True):
        np.testing.assert_array_equal(a.color, b.color)
        np.testing.assert_allclose(a.depth, b.depth, atol=5e-4)
        np.testing.assert_array_equal(b.depth, c.depth)
        assert 0 < np.abs(b.X_WC - c.X_WC).max() < 0.01
        assert len(np.unique(b.labels)) >= 4


def test_what_is_finished_is_not_done_again(folder, capsys) -> None:
    own, mark = folder / "own", {"frames": 3, "marked": True}
    before = json.loads((own / "film_005" / "film.json").read_text())
    (own / "film_005" / "film.json").write_text(json.dumps({**before, **mark}))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(films, "FILMS", 1)
        assert main(["evaluate", "--suite", "films", "--seed", "5", "--output", str(own)]) == 0
    assert json.loads((own / "summary.json").read_text())["films"]["still scene, seed 5"]["marked"]


def test_another_folder_and_one_without_recordings_are_refused_in_one_line(folder, capsys, tmp_path) -> None:
    assert main(["evaluate", "--suite", "films", "--seed", "6", "--output", str(folder / "own")]) == 2
    assert "holds something else" in capsys.readouterr().err
    assert main(["evaluate", "--suite", "films", "--recordings", str(tmp_path), "--output", "x"]) == 2
    assert "holds no recording" in capsys.readouterr().err


def test_a_recording_that_is_named_as_a_film_is_refused(tmp_path, capsys) -> None:
    (tmp_path / "film_003").mkdir()
    (tmp_path / "film_003" / "camera.json").write_text("{}")
    output = tmp_path / "out"
    arguments = ["--recordings", str(tmp_path), "--output", str(output)]
    assert main(["evaluate", "--suite", "films", "--seed", "2", *arguments]) == 2
    assert "a recording is named film_003, as a film that is made here" in capsys.readouterr().err
    assert not output.exists()


@pytest.mark.parametrize("content", ["{}", '{"a": 1}', '{"frames": 3}', "[1]", "no JSON"])
def test_a_film_whose_scores_lack_something_is_done_anew(tmp_path, content) -> None:
    (tmp_path / films.FILM_FILE).write_text(content)
    assert films._finished(tmp_path) == {}
