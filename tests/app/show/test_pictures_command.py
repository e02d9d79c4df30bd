import shutil

import cv2
import pytest
from PIL import Image

from riseg_drake.app.cli import main

LARGEST_FILM = 400_000  # bytes


@pytest.mark.renders
@pytest.mark.skipif(shutil.which("dot") is None, reason="graphviz is not installed")
def test_all_pictures_are_made_and_can_be_opened(small_scenario, tmp_path):
    evaluation, output = tmp_path / "evaluation", tmp_path / "docs" / "pictures"
    evaluation.mkdir()
    (evaluation / "figure.png").write_bytes(b"a figure")
    arguments = ["pictures", str(small_scenario), "--seed", "1", "--output", str(output)]
    assert main([*arguments, "--evaluation", str(evaluation)]) == 0
    with Image.open(output / "run.webp") as film:
        assert film.n_frames > 10
        assert 600 < film.width <= 800
    assert (output / "run.webp").stat().st_size < LARGEST_FILM
    assert cv2.imread(str(output / "run.jpg")) is not None
    for name in ("simulation", "hardware"):
        assert "MaskPropagator" in (output / f"{name}_diagram.svg").read_text()
    assert (output / "evaluation.png").read_bytes() == b"a figure"


def test_a_folder_without_an_evaluation_is_one_line_before_anything_is_drawn(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("riseg_drake.app.show.command.require_graphics", lambda: None)
    monkeypatch.setattr("riseg_drake.app.show.command.require_dot", lambda: None)
    assert main(["pictures", "--output", str(tmp_path / "o"), "--evaluation", str(tmp_path)]) == 2
    assert "riseg evaluate" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


def test_without_graphviz_nothing_is_begun(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("riseg_drake.app.show.command.require_graphics", lambda: None)
    monkeypatch.setattr("shutil.which", lambda _: None)
    assert main(["pictures", "--output", str(tmp_path / "o")]) == 2
    assert "graphviz" in capsys.readouterr().err
