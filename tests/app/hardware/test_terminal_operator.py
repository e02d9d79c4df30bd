import io
import time
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from riseg_drake.app.hardware.terminal_operator import TerminalOperator
from riseg_drake.pushing.push import Push
from riseg_drake.systems.arm_motion import Permission

PUSH = Push(
    p_WE=np.array([0.4, 0.0, 0.02]),
    tip_height=0.02,
    direction_W=np.array([1.0, 0.0]),
    p_WB=np.array([0.42, 0.0, 0.02]),
    length=0.03,
    d_push=0.02,
    center_W=np.array([0.45, 0.0]),
    cluster_W=np.zeros((3, 2)),
    tallest=0.08,
    cost=1.0,
)


class Terminal:
    """Lines that somebody types as they are asked for, and waits with until then."""

    def __init__(self, *lines):
        self.lines = list(lines)
        self.asked = False

    def __iter__(self):
        while not self.asked:
            time.sleep(0.001)
        yield from self.lines


def ask(operator, terminal, question):
    first = question()
    terminal.asked = True
    deadline = time.monotonic() + 5
    answer = first
    while answer in ("", None, Permission.WAIT) and time.monotonic() < deadline:
        answer = question()
    return first, answer


def operator(*lines, consents=False):
    terminal, out = Terminal(*lines), io.StringIO()
    return TerminalOperator(Console(file=out, width=200), consents, terminal), terminal, out


@pytest.mark.parametrize(
    ("typed", "permission"), [("y\n", Permission.DO), ("n\n", Permission.SKIP), ("q\n", Permission.END)]
)
def test_a_push_waits_for_its_answer(typed, permission):
    person, terminal, out = operator(typed)
    first, answer = ask(person, terminal, lambda: person.permit(PUSH))
    assert first is Permission.WAIT
    assert answer is permission
    assert out.getvalue().count("push at (0.420, 0.000)") == 1
    assert "tip at z = 0.020 m" in out.getvalue()
    assert "back of the tool" not in out.getvalue()


def test_the_operator_is_told_where_the_tool_turns_around():
    person, terminal, out = operator("y\n")
    ask(person, terminal, lambda: person.permit(replace(PUSH, turned=True)))
    assert ") with the back of the tool, tip at z = 0.020 m" in out.getvalue()


def test_what_is_no_answer_is_asked_again():
    person, terminal, out = operator("what?\n", "y\n")
    assert ask(person, terminal, lambda: person.permit(PUSH))[1] is Permission.DO
    assert "please answer one of y n q" in out.getvalue()


def test_a_closed_terminal_ends_it():
    person, terminal, _ = operator()
    assert ask(person, terminal, lambda: person.permit(PUSH))[1] is Permission.END


def test_who_consents_to_pushes_does_not_consent_to_go_on_after_a_stop():
    person, _, out = operator(consents=True)
    assert person.permit(PUSH) is Permission.DO
    assert person.released("the arm is stopped: reflex") is False
    assert "reflex" in out.getvalue()


def test_a_stop_is_released_by_the_operators_word():
    person, terminal, _ = operator("g\n")
    assert ask(person, terminal, lambda: person.released("stopped")) == (None, True)
