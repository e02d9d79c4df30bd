import signal
from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.app.cli import main
from riseg_drake.app.hardware import drive_arm
from riseg_drake.app.hardware.drive_arm import Checks, tool_load
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import READY
from riseg_drake.stations.franka_link import RobotStopped
from tests.stations.driven_robot import DrivenRobot


class StillRobot:
    """Says where it is, a thousand times a second by its own clock, and never moves."""

    system = "its system speaks server version 10"

    def __init__(self, q=READY, load=(0.325, None), mode=1, errors=(), slower=1.0):
        self.reading, self.set_load = replace(DrivenRobot(q=q).reading(), mode=mode, errors=errors), load
        self.slower, self.now, self.reads = slower, 50.0, 0

    def read(self):
        self.reading = replace(self.reading, time=self.reading.time + 0.001)
        self.now += 0.001 * self.slower
        self.reads += 1
        return self.reading

    def monotonic(self):
        return self.now

    def load(self):
        mass, center = self.set_load
        return mass, tool_load(FR3)[1] if center is None else np.array(center)

    def control(self, *_):
        pytest.fail("a check moves nothing")

    recover = control


FR3 = PandaDescription(robot="fr3")


@pytest.fixture
def checked(monkeypatch):
    def check(robot):
        monkeypatch.setattr(drive_arm, "time", robot)
        checks = Checks(robot, FR3, seconds=0.05)
        return checks.lines(), checks.problems

    return check


def test_the_built_in_tool_weighs_what_its_model_says():
    mass, center = tool_load(PandaDescription())
    assert mass == pytest.approx(0.25 + 0.075, abs=0.01)
    assert 0.05 < center[2] < 0.15


def test_a_robot_that_can_be_driven_has_no_problem_and_is_told_of(checked):
    mass, _ = tool_load(FR3)
    robot = StillRobot(load=(mass, None))
    lines, problems = checked(robot)
    assert problems == []
    assert robot.reads == 51  # the first one, and 50 ms
    assert lines[2] == "rate: 1000.0 states a second over 0.05 s"
    assert lines[0].startswith("robot: fr3; its system speaks server version 10")
    assert lines[1] == "mode: idle"


def test_a_load_that_was_not_set_in_desk_is_told_with_what_to_set(checked):
    _, problems = checked(StillRobot(load=(0.0, (0, 0, 0))))
    assert len(problems) == 1
    assert problems[0].startswith("the load set in Desk is 0.00 kg")


@pytest.mark.parametrize(
    ("mass_off", "center_off", "is_told"),
    [
        (0.045, 0.0, False),
        (-0.055, 0.0, True),
        (0.055, 0.0, True),
        (0.0, 0.019, False),
        (0.0, 0.021, True),
        (0.0, -0.021, True),
    ],
)
def test_a_load_may_be_off_by_50_g_and_2_cm_in_each_direction(mass_off, center_off, is_told, checked):
    mass, center = tool_load(FR3)
    _, problems = checked(StillRobot(load=(mass + mass_off, center + center_off * np.array([0, 1, 0]))))
    assert bool(problems) is is_told


@pytest.mark.parametrize(("slower", "problems"), [(1.009, 0), (1.011, 1)])
def test_fewer_than_990_states_a_second_are_told_with_what_to_do(slower, problems, checked):
    mass, _ = tool_load(FR3)
    lines, found = checked(StillRobot(load=(mass, None), slower=slower))
    assert lines[2] == f"rate: {1000 / slower:.1f} states a second over 0.05 s"
    assert len(found) == problems
    assert all("wire the control box directly" in problem for problem in found)


def test_errors_are_told_by_name_and_a_joint_out_of_range_asks_for_the_other_robot(checked):
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


class Begun(StillRobot):
    """A robot that was connected to; its control asks for three cycles, and then somebody presses Ctrl-C."""

    refuses = False

    def __init__(self):
        mass, center = tool_load(FR3)
        super().__init__(load=(mass, center))
        self.configured, self.modes, self.told = 0, [], []

    def configure(self):
        self.configured += 1
        if self.refuses:
            raise RobotStopped("user stop")

    def control(self, is_velocity, cycle):
        self.modes.append(is_velocity)
        self.told = [cycle(self.read()) for _ in range(3)]
        signal.raise_signal(signal.SIGINT)
        self.told.append(cycle(self.read()))


@pytest.fixture
def begun(monkeypatch, tmp_path):
    robot = Begun()
    (tmp_path / "arm.yaml").write_text(
        "station: !HardwareStationConfig {lcm: {url: 'memq://'}, panda: {robot: fr3}}\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(drive_arm, "FrankaLink", lambda name, ip: robot)
    monkeypatch.setattr(drive_arm, "be_prompt", lambda priority: setattr(robot, "priority", priority))
    return robot


@pytest.mark.parametrize(
    ("words", "is_velocity"), [([], True), (["--mode", "position"], False), (["--mode", "velocity"], True)]
)
def test_it_drives_in_the_scenarios_mode_or_the_one_it_was_told_until_ctrl_c(words, is_velocity, begun, capsys):
    handler = signal.getsignal(signal.SIGINT)
    assert main(["drive-arm", "arm.yaml", "--ip", "172.16.0.2", *words]) == 0
    assert (begun.configured, begun.modes) == (1, [is_velocity])
    assert [finished for _, finished in begun.told] == [False, False, False, True]
    assert signal.getsignal(signal.SIGINT) is handler
    assert begun.priority == 80  # docs/hardware.md has it: `ulimit -r 80`
    out = " ".join(capsys.readouterr().out.split())
    mode = "velocity" if is_velocity else "position"
    assert f"drive-arm: fr3 at 172.16.0.2, commands of {mode} from PANDA_COMMAND; " in out
    assert out.endswith("(longest) in 4 cycles")


def test_a_robot_that_takes_no_thresholds_now_is_driven_all_the_same_and_that_is_told(begun, capsys):
    begun.refuses = True
    assert main(["drive-arm", "arm.yaml", "--ip", "172.16.0.2"]) == 0
    assert "forces of its reflexes were not set: user stop" in capsys.readouterr().out
    assert len(begun.modes) == 1


def test_a_check_reads_for_5_s_moves_nothing_and_fails_where_something_would_not_do(begun, monkeypatch, capsys):
    monkeypatch.setattr(drive_arm, "time", begun)
    assert main(["drive-arm", "arm.yaml", "--ip", "172.16.0.2", "--check"]) == 0
    assert "rate: 1000.0 states a second over 5 s" in capsys.readouterr().out
    assert (begun.reads, begun.configured, begun.modes) == (5001, 0, [])
    begun.set_load = (0.0, np.zeros(3))
    assert main(["drive-arm", "arm.yaml", "--ip", "172.16.0.2", "--check"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("riseg: the load set in Desk is 0.00 kg")
    assert error.count("\n") == 1
