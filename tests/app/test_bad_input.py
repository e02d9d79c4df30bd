import os
import subprocess
import sys

import pytest

from riseg_drake.app.cli import main
from riseg_drake.app.scenario import Scenario, load_scenario

# The command first tries whether images can be drawn, and settles the scene.
pytestmark = pytest.mark.renders


def test_the_built_in_scenario_is_what_the_dataclasses_say():
    # One truth: the file shows and explains defaults, it does not change them.
    assert repr(load_scenario(None)) == repr(Scenario())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sation: {}", "unknown key 'sation'; did you mean 'station'?"),
        ("station: {camera: {rate: quick}}", "station.camera.rate must be a number, not 'quick'"),
        ("station: {scene: {objects: /nowhere}}", "/nowhere"),
        ("station: {scene: {count_min: 6, radius: 0.04}}", "do not fit"),
        ("station: {observe_height: 3.0}", "observe_height"),
        ("station: {table: {url: package://riseg_drake_models/no.sdf}}", "no.sdf"),
    ],
)
def test_a_scenario_that_cannot_be_is_one_line_and_exit_code_2(tmp_path, capsys, text, message):
    path = tmp_path / "scenario.yaml"
    path.write_text(text)
    assert main(["run", str(path), "--output", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("riseg: ")
    assert message in error
    assert error.count("\n") == 1


def test_a_missing_scenario_is_one_line_and_exit_code_2(tmp_path, capsys):
    assert main(["run", str(tmp_path / "nowhere.yaml")]) == 2
    assert "nowhere.yaml is not there" in capsys.readouterr().err


def test_an_output_folder_with_other_things_is_left_alone(tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("mine")
    assert main(["run", "--output", str(tmp_path)]) == 2
    assert "holds no earlier run" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_without_egl_the_packages_are_named_before_anything_aborts(tmp_path):
    # An empty list of drivers is what a machine without them has.
    done = subprocess.run(
        [sys.executable, "-m", "riseg_drake", "run"],
        cwd=tmp_path,
        env={**os.environ, "__EGL_VENDOR_LIBRARY_DIRS": str(tmp_path), "__EGL_VENDOR_LIBRARY_FILENAMES": ""},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert "libegl1 libgl1 libgl1-mesa-dri" in done.stderr
    assert done.stderr.count("\n") == 1
