"""A small share of `python -m tests.faults inputs`, for every day; it watches neither time nor memory."""

import random

import pytest

from tests.faults.readers import NEEDS, READERS, prepared

INPUTS = 12


@pytest.mark.renders
@pytest.mark.parametrize("name", [name for name in READERS if name not in NEEDS])
def test_mutated_input_is_read_or_refused_in_one_line(name, tmp_path, capsys):
    for case in (-1, *range(INPUTS)):
        prepared(READERS[name], tmp_path / "work")
        if case >= 0:
            READERS[name].mutate(tmp_path / "work", random.Random(f"{name} every day {case}"))
        code = READERS[name].read(tmp_path / "work")
        said = capsys.readouterr().err
        assert code in ((0, 2) if case >= 0 else (0,)), (case, said)
        assert said.count("\n") <= 1, (case, said)
