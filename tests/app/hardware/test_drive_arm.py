from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.app.cli import main
from riseg_drake.app.hardware.drive_arm import Checks, tool_load
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import READY
from tests.stations.driven_robot import DrivenRobot


class StillRobot:
    """Says where it is, a thousand times a second by its own clock, and never moves."""

    system = "its system speaks server version 10"

    def __init__(self, q=READY, load=(0.325, None), mode=1, errors=()):
        self.reading, self.set_load = replace(DrivenRobot(q=q).reading(), mode=mode, errors=errors), load

    def read(self):
        self.reading = replace(self.reading, time=self.reading.time + 0.001)
        return self.reading

    def load(self):
        mass, center = self.set_load
        return mass, tool_load(FR3)[1] if center is None else np.array(center)

    def control(self, *_):
        pytest.fail("a check moves nothing")

    recover = control


FR3 = PandaDescription(robot="fr3")


def checked(robot):
    checks = Checks(robot, FR3, seconds=0.05)
    lines = checks.lines()
    return lines, [problem for problem in checks.problems if "states a second" not in problem]


def test_the_built_in_tool_weighs_what_its_model_says():
    mass, center = tool_load(PandaDescription())
    assert mass == pytest.approx(0.25 + 0.075, abs=0.01)
    assert 0.05 < center[2] < 0.15


def test_a_robot_that_can_be_driven_has_no_problem_and_is_told_of():
    mass, _ = tool_load(FR3)
    lines, problems = checked(StillRobot(load=(mass, None)))
    assert problems == []
    assert lines[0].startswith("robot: fr3; its system speaks server version 10")
    assert lines[1] == "mode: idle"


def test_a_load_that_was_not_set_in_desk_is_told_with_what_to_set():
    _, problems = checked(StillRobot(load=(0.0, (0, 0, 0))))
    assert len(problems) == 1
    assert problems[0].startswith("the load set in Desk is 0.00 kg")


def test_errors_are_told_by_name_and_a_joint_out_of_range_asks_for_the_other_robot():
    q = READY.copy()
    q[5] = 0.3  # within a Panda's range
    lines, problems = checked(StillRobot(q, mode=4, errors=("joint_reflex",)))
    assert lines[1] == "mode: reflex, errors: joint_reflex"
    assert any("joint 6 is 0.241 rad out of the range" in problem for problem in problems)


def test_without_its_library_the_command_ends_in_one_line(monkeypatch, capsys):
    monkeypatch.setitem(__import__("sys").modules, "panda_py", None)
    monkeypatch.setitem(__import__("sys").modules, "panda_py.libfranka", None)
    assert main(["drive-arm", "--ip", "127.0.0.1"]) == 2
    assert "pip install 'riseg-drake[panda]'" in capsys.readouterr().err
