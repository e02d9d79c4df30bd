import json

import cv2
import numpy as np
import pytest

from riseg_drake.app.cli import main
from riseg_drake.evaluation.scores import FIGURES


@pytest.fixture
def folders(tmp_path):
    true = np.zeros((20, 30), np.uint16)
    true[5:10, 5:10] = 1
    for name in ("predicted", "true"):
        (tmp_path / name).mkdir()
        cv2.imwrite(str(tmp_path / name / "0.png"), true)
    cv2.imwrite(str(tmp_path / "true" / "1.png"), true)
    cv2.imwrite(str(tmp_path / "predicted" / "1.png"), np.zeros_like(true))
    return tmp_path


def test_the_mean_and_every_image_are_in_the_json(folders, capsys):
    out = folders / "scores.json"
    assert main(["score", str(folders / "predicted"), str(folders / "true"), "--json", str(out)]) == 0
    content = json.loads(out.read_text())
    assert tuple(content["scores"]) == FIGURES
    assert content["scores"]["Objects F-measure"] == 0.5
    assert content["images"]["1.png"]["Objects Precision"] == 1
    printed = capsys.readouterr().out
    assert "2 images" in printed
    (mean,) = [line.split() for line in printed.splitlines() if line.split()[:1] == ["mean"]]
    assert mean[1:4] == ["100.0", "50.0", "50.0"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["score", "predicted", "nowhere"],
        ["score", "predicted"],
        ["score", "predicted", "true", "--json", "nowhere/scores.json"],
        ["walk"],
        [],
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(folders, monkeypatch, capsys, arguments):
    monkeypatch.chdir(folders)
    try:
        code = main(arguments)
    except SystemExit as stop:
        code = stop.code
    assert code == 2
    error = capsys.readouterr().err
    assert error.startswith("riseg")
    assert error.count("\n") == 1


def test_every_command_is_explained_in_two_lines(capsys):
    for command in ("run", "score", "bench", "diagram"):
        with pytest.raises(SystemExit) as stop:
            main([command, "--help"])
        assert stop.value.code == 0
        explanation = capsys.readouterr().out.split("\n\n")[1]
        assert len(explanation.splitlines()) == 2


def test_names_with_brackets_are_said_as_they_are(folders, capsys):
    for folder in ("predicted", "true"):
        name = next((folders / folder).rglob("*.png"))
        name.rename(name.with_name("[red]x[[b].png"))
    assert main(["score", str(folders / "predicted"), str(folders / "true")]) == 0
    assert "[red]x[[b].png" in capsys.readouterr().out


def test_json_goes_where_a_link_leads(folders):
    (folders / "link.json").symlink_to(folders / "real.json")
    arguments = [
        "score",
        str(folders / "predicted"),
        str(folders / "true"),
        "--json",
        str(folders / "link.json"),
    ]
    assert main(arguments) == 0
    assert (folders / "link.json").is_symlink()
    assert "scores" in json.loads((folders / "real.json").read_text())
