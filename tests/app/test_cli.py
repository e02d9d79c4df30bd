"""What becomes of a command whose output nobody reads any more, and of what is wrong."""

import os
import subprocess
import sys

import numpy as np
import pytest

from riseg_drake.app import cli
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.segmentation.table_plane import fit_plane


@pytest.mark.renders
def test_a_reader_that_has_enough_is_no_error():
    reading, writing = os.pipe()
    os.close(reading)
    code = "from riseg_drake.app.cli import main; raise SystemExit(main(['diagram']))"
    done = subprocess.run([sys.executable, "-c", code], stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert done.returncode == 0
    assert b"Traceback" not in done.stderr


def test_any_other_broken_pipe_is_not_taken_for_success(monkeypatch):
    def broken(*_: object) -> None:
        raise BrokenPipeError

    monkeypatch.setattr("riseg_drake.app.commands.diagram", broken)
    monkeypatch.setattr(cli, "nobody_reads", lambda: False)
    with pytest.raises(BrokenPipeError):
        cli.main(["diagram"])


def test_a_picture_without_a_table_is_one_line_and_no_fault_of_the_program(monkeypatch, capsys):
    def blind(*_: object) -> None:
        fit_plane(np.zeros((8, 8), np.float32), Intrinsics(8, 8, 8.0, 8.0, 3.5, 3.5), np.random.default_rng(0))

    monkeypatch.setattr("riseg_drake.app.commands.hand_eye", blind)
    assert cli.main(["hand-eye"]) == 2
    assert capsys.readouterr().err == "riseg: no plane: 0 pixels with depth, at least 3 are needed\n"


@pytest.mark.parametrize("command", ["run", "evaluate", "hardware", "emulate", "bench", "pictures"])
@pytest.mark.parametrize("seed", ["-1", "1e3", "1.5", "9" * 30])
def test_a_seed_that_is_none_is_said_by_the_name_of_its_option(command, seed, capsys):
    with pytest.raises(SystemExit):
        cli.main([command, f"--seed={seed}"])
    assert "--seed: " in (error := capsys.readouterr().err)
    assert "is not a whole number from 0 to 999999999" in error
