"""The arm's driver against a robot that others wrote, which enforces the limits of a Franka Research 3."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.pushing.push_path import PlannedSpeed, PushPathParameters, plan_push_path
from riseg_drake.robot.command_limiter import CommandLimits
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics, observe_pose
from riseg_drake.robot.limits import FR3_LIMITS
from riseg_drake.robot.supervisor import MOVE, REFLEX, USER_STOPPED, Cause, Mode
from riseg_drake.stations.arm_drive import LIMITS, Drive
from riseg_drake.stations.franka_link import FrankaLink, LinkError
from riseg_drake.stations.rate_limiter import TICK
from tests.stations.franka_rig import FrankaServer, Rig, franka_python

pytestmark = pytest.mark.renders
MODES = ("position", "velocity")
USED = CommandLimits()
PLANNED = PlannedSpeed(0.8 * USED.velocity, 0.6 * USED.acceleration, 0.4 * USED.jerk)  # as for `riseg hardware`
PATH = PushPathParameters(limits=PLANNED, longest=30.0)
IN_MOTION = 1900  # ticks; the arm goes down to the push


@pytest.fixture(scope="module")
def kinematics():
    return PandaKinematics(PandaDescription(robot="fr3"))


@pytest.fixture(scope="module")
def q_observe(kinematics):
    franka_python()
    return kinematics.solve_ik(observe_pose([0.5, 0.0, 0.0], 0.5, kinematics.X_EC))


@pytest.fixture(scope="module")
def targets(kinematics, q_observe):
    """Each 10 ms of a whole push: there, down, 12 cm ahead, and back."""
    push = replace(
        NO_PUSH,
        p_WE=np.array([0.45, -0.08, 0.01]),
        tip_height=0.01,
        direction_W=np.array([0.6, 0.8]),
        length=0.12,
        d_push=0.1,
        tallest=0.08,
        cost=0.0,
    )
    path = plan_push_path(push, kinematics, q_observe, PATH)
    times = np.arange(0, path.trajectory.end_time() + 1.0, 0.01).clip(0, path.trajectory.end_time())
    return np.array([path.trajectory.value(time)[:, 0] for time in times])


def shares(rows):
    """Largest shares of the limits of acceleration and jerk in what the robot set itself."""
    modes, q_d, _ = rows
    largest = np.zeros(2)
    moves = np.flatnonzero(modes == MOVE)
    for run in np.split(moves, np.flatnonzero(np.diff(moves) > 1) + 1):
        a = np.diff(q_d[run[2:]], 2, axis=0) / TICK**2
        largest = np.maximum(
            largest,
            [
                np.abs(a / FR3_LIMITS.acceleration).max(initial=0),
                np.abs(np.diff(a, axis=0) / TICK / FR3_LIMITS.jerk).max(initial=0),
            ],
        )
    return largest


@pytest.mark.parametrize("mode", MODES)
def test_a_whole_push_goes_through_calmly_and_within_3_mm_of_the_plan(mode, kinematics, q_observe, targets):
    with FrankaServer("127.0.0.51", q_observe) as server:
        rig = Rig(server, mode, targets).run(1500 + 10 * len(targets))
        modes, q_d, q = rows = server.rows()
    assert rig.said == []
    assert REFLEX not in modes
    assert rig.stream.behind == 0
    acceleration, jerk = shares(rows)
    planned = np.array([kinematics.X_WE(target)[:3, 3] for target in targets])
    off = {
        name: max(np.linalg.norm(planned - kinematics.X_WE(at)[:3, 3], axis=1).min() for at in path[3:-3:20])
        for name, path in (("told", q_d), ("measured", q))
    }
    print(f"{mode}: acceleration {acceleration:.3f}, jerk {jerk:.3f} of the limits; tip off its path {off}, m")
    print(f"{mode}: work of a cycle {rig.process.cycles.told()}")
    assert max(acceleration, jerk) <= 0.5
    assert max(off.values()) <= 0.003
    np.testing.assert_allclose(q_d[-5], targets[-1], atol=2e-3)


def stopped(rig, server, since=IN_MOTION):
    """How the arm stopped: whether within limits, after how many ticks, and where it stood then."""
    modes, q_d, _ = rows = server.rows()
    acceleration, jerk = shares(rows)
    assert acceleration <= LIMITS.stop_acceleration + 1e-3
    assert jerk <= LIMITS.stop_jerk + 1e-3
    return modes, q_d


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    ("kind", "robot_mode", "cause", "reason"),
    [
        ("reflex", REFLEX, Cause.REFLEX, "joint_velocity_violation"),
        ("press", USER_STOPPED, Cause.USER_STOP, "the stop button is pressed"),
    ],
)
def test_after_a_stop_of_the_robot_in_motion_it_goes_on_only_at_the_word(
    mode, kind, robot_mode, cause, reason, q_observe, targets
):
    with FrankaServer("127.0.0.52", q_observe) as server:
        rig = Rig(server, mode, targets[:200])
        seen = {}

        def see(name):
            seen[name] = (rig.session.report().state, rig.drive.state, rig.session._status.robot_mode)

        rig.events = {
            IN_MOTION: lambda: server.say(kind),
            IN_MOTION + 300: lambda: see("stopped"),
            IN_MOTION + 310: lambda: server.say("release"),
            IN_MOTION + 600: lambda: see("still"),
            IN_MOTION + 610: lambda: (rig.session.obey("abandon"), rig.session.obey("release")),
            IN_MOTION + 1500: lambda: see("after"),
        }
        if kind == "reflex":
            del rig.events[IN_MOTION + 310]
        rig.run(IN_MOTION + 1600)
        stopped(rig, server)
    assert seen["stopped"][0].mode is Mode.STOPPED
    assert seen["stopped"][0].cause is cause
    assert seen["stopped"][1:] == (Drive.LOST, robot_mode)
    assert seen["still"][1] is Drive.LOST
    assert rig.said[0] == f"the robot takes no commands: {reason}; waits for the operator's word"
    assert seen["after"][0].mode is Mode.FOLLOWING
    assert seen["after"][1:] == (Drive.FOLLOWING, MOVE)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", ["stale", "NaN"])
def test_commands_that_end_or_are_none_stop_the_arm_within_limits_until_the_word(
    mode, kind, q_observe, targets
):
    with FrankaServer("127.0.0.53", q_observe) as server:
        rig = Rig(server, mode, targets[:200])
        seen = {}

        def fail():
            if kind == "stale":
                rig.sends = False
            else:
                bad = np.full(7, np.nan)
                rig.publish(bad)

        def resume():
            rig.sends = True

        rig.events = {
            IN_MOTION: fail,
            IN_MOTION + 500: resume,
            IN_MOTION + 700: lambda: seen.update(stopped=(rig.drive.state, rig.session.report().state.mode)),
            IN_MOTION + 710: lambda: (rig.session.obey("abandon"), rig.session.obey("release")),
            IN_MOTION + 1500: lambda: seen.update(after=(rig.drive.state, rig.session.report().state.mode)),
        }
        rig.run(IN_MOTION + 1600)
        modes, q_d = stopped(rig, server)
    assert REFLEX not in modes
    still = q_d[IN_MOTION + 450 : IN_MOTION + 700]
    assert np.ptp(still, axis=0).max() < 1e-6
    assert seen["stopped"] == ({"stale": Drive.EXPIRED, "NaN": Drive.REFUSED}[kind], Mode.STOPPED)
    assert seen["after"] == (Drive.FOLLOWING, Mode.FOLLOWING)
    assert len(rig.said) == 2


@pytest.mark.parametrize("mode", MODES)
def test_cycles_that_do_not_wait_for_an_answer_are_gone_on_from(mode, q_observe, targets):
    with FrankaServer("127.0.0.54", q_observe) as server:
        rig = Rig(server, mode, targets[:200])
        rig.events = {IN_MOTION: lambda: server.say("lose 5")}
        rig.run(IN_MOTION + 200)
        assert REFLEX not in server.rows()[0]
    assert rig.said == []


def test_a_robot_that_is_gone_ends_the_driver_in_one_line(q_observe, targets):
    with FrankaServer("127.0.0.55", q_observe) as server:
        rig = Rig(server, "position", targets)
        rig.events = {IN_MOTION: server.process.kill}
        with pytest.raises(LinkError, match="the robot says nothing any more: "):
            rig.run(IN_MOTION + 200)


def test_a_driver_that_is_killed_leaves_the_robot_at_rest(q_observe, targets):
    with FrankaServer("127.0.0.56", q_observe) as server:
        rig = Rig(server, "position", targets)

        class Killed(BaseException):
            pass

        def kill():
            raise Killed

        rig.events = {IN_MOTION: kill}
        with suppress(Killed):
            rig.run(IN_MOTION + 200)
        assert rig.ticks == IN_MOTION
        rig.link.link = None  # its connection ends, as that of a process does
        link = FrankaLink("fr3", server.address)
        readings = [link.read() for _ in range(1000)]
    assert readings[-1].mode != MOVE
    assert np.abs(readings[-1].velocity).max() < 1e-3


def test_another_version_of_libfranka_is_told_in_one_line_with_the_remedy(q_observe):
    with FrankaServer("127.0.0.57", q_observe) as server:
        server.say("version 5")
        with pytest.raises(LinkError, match=r"server version 5.*speaks version 10.*riseg-drake\[panda\]"):
            FrankaLink("fr3", server.address)
