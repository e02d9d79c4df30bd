import pytest

from riseg_drake.app.cli import main
from riseg_drake.app.package import package_version


def refusal(arguments, capsys):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["segmnt", "x"], "segment"),
        (["hardwear"], "hardware"),
        (["--verison"], "--version"),
        (["run", "--ouput", "x"], "--output"),
        (["run", "--overwirte=yes"], "--overwrite"),
        (["score", "--jsno", "f", "a", "b"], "--json"),
        (["emulate", "--control-mode", "velocty"], "velocity"),
    ],
)
def test_the_nearest_command_option_or_choice_is_named_in_the_one_line_of_refusal(arguments, meant, capsys):
    assert f"; did you mean {meant}?; see riseg" in refusal(arguments, capsys)


def test_an_unknown_option_is_refused_by_its_command_and_not_by_the_whole_program(capsys):
    assert refusal(["run", "--ouput", "x"], capsys).startswith("riseg run: unrecognized arguments: --ouput")


@pytest.mark.parametrize("arguments", [["xyzzy"], ["run", "--xyzzy"], ["score", "a", "b", "c"]])
def test_what_is_like_nothing_there_is_gets_no_guess(arguments, capsys):
    assert "did you mean" not in refusal(arguments, capsys)


def test_the_version_is_that_of_the_package(capsys):
    with pytest.raises(SystemExit) as end:
        main(["--version"])
    assert end.value.code == 0
    assert capsys.readouterr().out == f"riseg {package_version()}\n"
