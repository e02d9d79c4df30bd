"""The tables of docs/commands.md against the parser: every option is there, and no other."""

import re

import pytest

from riseg_drake.app.arguments import command_line
from tests.docs.pages import CHECKOUT, code_spans, section, table_rows

PAGE = CHECKOUT / "docs" / "commands.md"
(COMMANDS,) = (action.choices for action in command_line()._actions if action.choices)


def test_every_command_has_a_section_and_stands_in_the_table_of_the_readme():
    assert set(re.findall(r"^## riseg (.*)$", PAGE.read_text(), re.M)) == set(COMMANDS)
    readme = {span.split()[1] for span in code_spans(CHECKOUT / "README.md") if span.startswith("riseg ")}
    assert set(COMMANDS) <= readme


@pytest.mark.parametrize("command", COMMANDS)
def test_the_table_of_a_command_has_its_options_and_their_words(command):
    rows = table_rows(section(PAGE, f"riseg {command}"))
    written = [" ".join(re.findall(r"`([^`]+)`", row[0])) for row in rows]
    real = []
    for action in COMMANDS[command]._actions:
        if "--help" in action.option_strings:
            continue
        words = action.option_strings or [action.metavar]
        if action.option_strings and action.nargs is None:
            word = action.metavar or ("MODE" if len(action.choices) > 1 else action.choices[0])
            words = [f"{words[0]} {word}"]
        elif action.nargs == "?" and action.option_strings:
            words = [f"{words[0]} [{action.metavar}]"]
        real.append(" ".join(words))
    assert sorted(written) == sorted(real)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_number_that_is_a_default_is_written(command):
    rows = table_rows(section(PAGE, f"riseg {command}"))
    said = {re.findall(r"`([^`]+)`", row[0])[0].split()[0]: row[1] for row in rows}
    for action in COMMANDS[command]._actions:
        if isinstance(action.default, int | float) and not isinstance(action.default, bool):
            assert re.search(rf"; {action.default:g}\b", said[action.option_strings[0]]), action.option_strings
