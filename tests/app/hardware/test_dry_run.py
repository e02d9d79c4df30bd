import io
from types import SimpleNamespace

import numpy as np
from rich.console import Console

from riseg_drake.app.hardware import dry_run
from riseg_drake.app.hardware.dry_run import DryRun
from riseg_drake.app.hardware.terminal_operator import TerminalOperator
from riseg_drake.app.run.interactions import Progress
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.robot.kinematics import READY, PandaKinematics
from riseg_drake.systems.arm_motion import Permission


class Browser:
    """Sees what is planned."""

    def __init__(self):
        self.shown, self.is_hidden = [], True

    def hide(self):
        self.is_hidden = True

    def show(self, push):
        self.is_hidden = False
        if not self.shown or self.shown[-1] is not push:
            self.shown.append(push)


class Person:
    """Answers as told."""

    def __init__(self, *answers):
        self.answers = list(answers)
        self.why_quit = "the operator ended it"

    def answer(self, question, choices):
        return self.answers.pop(0)


def push(turn=0.2):
    """A push whose path turns joint 1."""
    path = SimpleNamespace(
        duration=2.0, position=lambda t: READY + np.array([turn * t / 2.0, 0, 0, 0, 0, 0, 0])
    )
    contact, tip = np.array([0.5, 0.1, 0.02]), np.array([0.46, 0.1, 0.031])
    return SimpleNamespace(path=path, p_WB=contact, p_WE=tip, turned=False)


def made(*answers):
    scenario, out, browser = load_scenario(None, HARDWARE), io.StringIO(), Browser()
    person = Person(*answers) if answers else None
    progress = Progress()
    return DryRun(scenario, browser, person, Console(file=out, width=200), progress), browser, out, scenario


def test_every_push_is_shown_and_none_is_done():
    run, browser, out, scenario = made("", "", *"nnnnn")
    said = []
    for _ in range(scenario.arm.most_interactions):
        wanted = push()
        said += [run.permit(wanted)]
        while said[-1] is Permission.WAIT:
            said += [run.permit(wanted)]
    assert Permission.DO not in said
    assert said.count(Permission.WAIT) == 2
    assert said[-1] is Permission.END
    assert len(browser.shown) == out.getvalue().count("push ") == scenario.arm.most_interactions


def test_the_operator_reads_how_near_the_arm_comes_to_anything():
    run, _, out, _ = made("n")
    wanted = push(turn=0.3)
    run.permit(wanted)
    kinematics = PandaKinematics()
    least = min(kinematics.clearance(wanted.path.position(t)) for t in np.linspace(0, 2, 50))
    assert f"nothing nearer than {1e3 * least:.0f} mm" in out.getvalue()


def test_the_operator_reads_where_the_tip_goes_and_how_high():
    run, _, out, _ = made("n")
    run.permit(push())
    assert "push 1 at (0.500, 0.100) m, tip at z = 0.031 m" in out.getvalue()


def test_the_operator_may_end_it():
    run, browser, *_ = made("n", "q")
    assert run.permit(push()) is Permission.SKIP
    assert not browser.is_hidden
    assert run.permit(push()) is Permission.END
    assert browser.is_hidden  # what will never be done
    assert run._progress.end == "the operator ended it"


def test_without_a_terminal_it_ends_with_that_reason():
    scenario, console, progress = load_scenario(None, HARDWARE), Console(file=io.StringIO()), Progress()
    operator = TerminalOperator(console, consents=False, terminal=io.StringIO(""))
    run = DryRun(scenario, None, operator, console, progress)
    wanted, said = push(), Permission.WAIT
    while said is Permission.WAIT:
        said = run.permit(wanted)
    assert said is Permission.END
    assert progress.end.startswith("nobody can answer: there is no terminal")
    assert "--yes" in progress.end


def test_after_the_last_push_it_says_that_all_were_shown():
    run, *_, scenario = made(*"nnnnn")
    for _ in range(scenario.arm.most_interactions):
        run.permit(push())
    assert run._progress.end == "5 of 5 pushes were shown, and none was done"


def test_unasked_each_push_is_shown_for_a_while(monkeypatch):
    run, *_ = made()
    now = 100.0
    monkeypatch.setattr(dry_run.time, "monotonic", lambda: now)
    wanted = push()
    assert run.permit(wanted) is Permission.WAIT
    now += dry_run.SHOWN_FOR
    assert run.permit(wanted) is Permission.SKIP
