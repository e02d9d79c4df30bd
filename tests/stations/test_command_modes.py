"""Which mode is calm: what low pass and rate limiter make of a whole run in each, on a clock of its own.

`RISEG_ALL_MODES=1 python -m pytest -n 0 -s tests/stations/test_command_modes.py` prints the table of
docs/emulator.md; commands at 1 kHz take a minute more.
"""

import os

import numpy as np
import pytest

from riseg_drake.app.planned_speed import planned_limits
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.pushing.push import Push
from riseg_drake.pushing.push_path import PlannedSpeed, PushPathParameters, plan_push_path
from riseg_drake.robot.command_stream import CommandParameters
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics, observe_pose
from riseg_drake.robot.limits import ROBOTS
from tests.stations.driver_and_stream import DriverAndStream

pytestmark = pytest.mark.renders  # whole runs of the arm

INTERACTIONS = 5
CALM_ACCELERATION, CALM_AT_LIMIT = 0.3, 1e-3
"""What is asked of the mode that is used: acceleration, share of the limit, rms; share of ticks at a limit."""


def on_time(rng):
    """The process of commands never sleeps too long, s."""
    return 0.0


def jitter(rng):
    """It sleeps 0.3 ms too long, and 2 ms one time in a thousand: s; worse than `riseg bench --stream` says."""
    return rng.exponential(3e-4)


def planned_run(name):
    """Where a robot looks from [7], and its paths to some pushes here and there, as the product plans them."""
    kinematics = PandaKinematics(PandaDescription(robot=name))
    q_observe = kinematics.solve_ik(observe_pose([0.5, 0.0, 0.0], 0.5, kinematics.X_EC))
    speed = planned_limits(load_scenario(None, HARDWARE))
    parameters = PushPathParameters(limits=PlannedSpeed(speed.velocity, speed.acceleration, speed.jerk))
    rng, paths = np.random.default_rng(0), []
    while len(paths) < INTERACTIONS:
        angle = rng.uniform(-1.5, 1.5)
        ahead = np.array([np.cos(angle), np.sin(angle)])
        p_WB = np.append(rng.uniform([0.4, -0.15], [0.6, 0.15]), 0.02)
        push = Push(
            p_WE=p_WB - 0.015 * np.append(ahead, 0),
            tip_height=0.02,
            direction_W=ahead,
            p_WB=p_WB,
            length=0.035,
            d_push=0.02,
            center_W=p_WB[:2],
            cluster_W=np.zeros((0, 2)),
            tallest=0.08,
            cost=0.0,
        )
        path = plan_push_path(push, kinematics, q_observe, parameters)
        if path is not None:
            paths.append(path.trajectory)
    return q_observe, paths


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request):
    """A robot's name, where it looks from, and its paths."""
    return (request.param, *planned_run(request.param))


def verdict_on(robot, parameters, wakes_late, interactions=INTERACTIONS, pauses=False):
    """How calm the robot's own motion is over a whole run, with a pause for late pictures in every motion."""
    name, q_observe, paths = robot
    session = DriverAndStream(parameters.mode, ROBOTS[name], q_observe, parameters, wakes_late=wakes_late).run(
        0.1
    )
    for path in paths[:interactions]:
        session.plan(path)
        if pauses:
            session.run(path.end_time() / 3)
            session.shows_pictures = False
            session.run(1)
            session.shows_pictures = True
        session.run(path.end_time() + 1)
        while session.stream.behind:
            session.run(0.1)
    session.run(1)
    assert session.driver.end is None, session.driver.end
    np.testing.assert_allclose(session.robot.q_d, q_observe, atol=1e-3)
    verdict = session.driver.judge.verdict()
    print(f"\n{name}, {parameters.mode} at {parameters.rate:g} Hz, {wakes_late.__name__}: {verdict}")
    return verdict


def is_calm(verdict):
    assert verdict.seconds > 5
    return verdict.acceleration_rms <= CALM_ACCELERATION and verdict.at_limit <= CALM_AT_LIMIT


def test_in_the_mode_of_the_defaults_a_whole_run_is_calm_also_where_commands_come_unevenly(robot):
    assert is_calm(verdict_on(robot, CommandParameters(), jitter))


def test_so_it_is_where_pictures_come_late_in_every_motion(robot):
    verdict = verdict_on(robot, CommandParameters(), on_time, interactions=1, pauses=True)
    assert verdict.at_limit == 0
    assert verdict.acceleration_largest < 0.7  # of a stop: 1


def test_positions_at_200_hz_come_out_at_a_limit_in_most_ticks(robot):
    verdict = verdict_on(robot, CommandParameters(mode="position"), on_time, interactions=1)
    assert not is_calm(verdict)
    assert verdict.at_limit > 0.5


@pytest.mark.skipif("RISEG_ALL_MODES" not in os.environ, reason="RISEG_ALL_MODES=1 measures all modes")
@pytest.mark.parametrize(
    ("mode", "rate", "wakes_late", "calm"),
    [
        ("position", 200.0, on_time, False),
        ("position", 200.0, jitter, False),
        ("position", 1000.0, on_time, True),
        ("position", 1000.0, jitter, None),
        ("velocity", 200.0, on_time, True),
    ],
)
def test_every_other_mode(robot, mode, rate, wakes_late, calm):
    verdict = verdict_on(robot, CommandParameters(mode=mode, rate=rate), wakes_late)
    assert calm is None or is_calm(verdict) == calm
