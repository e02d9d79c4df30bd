"""One line is told, whatever it holds."""

import subprocess
import sys
import warnings

import pytest

from riseg_drake.app.cli import main
from riseg_drake.host.terminal import LONGEST_LINE, Notice, one_line, tell_notices


def test_line_ends_and_what_commands_a_terminal_are_taken_out():
    assert one_line("a\n  b\x1b[31m\x00é") == "a b\\x1b[31m\\x00é"


def test_the_middle_of_a_very_long_line_is_left_out():
    line = one_line("a" * 5000 + "z")
    assert len(line) <= LONGEST_LINE
    assert line[0] == "a"
    assert line[-1] == "z"


def test_a_name_of_thousands_of_characters_is_one_line_that_can_be_read(capsys):
    assert main(["segment", "a" * 5000]) == 2
    assert len(capsys.readouterr().err) < LONGEST_LINE + 20


@pytest.mark.renders
def test_an_output_without_room_is_one_line_and_exit_code_2():
    with open("/dev/full", "w") as full:
        words = [sys.executable, "-m", "riseg_drake", "diagram"]
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "riseg: the output: No space left on device\n"


def test_a_notice_is_one_line_on_the_error_stream_and_other_warnings_stay_as_they_are(capsys, monkeypatch):
    others = []
    monkeypatch.setattr(warnings, "showwarning", lambda message, *more: others.append(str(message)))
    tell_notices()
    warnings.showwarning(Notice("seven\nmodels"), Notice, "file.py", 3)
    warnings.showwarning(UserWarning("careful"), UserWarning, "file.py", 4)
    assert capsys.readouterr().err == "riseg: seven models\n"
    assert others == ["careful"]
