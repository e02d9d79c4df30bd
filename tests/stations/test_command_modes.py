"""Which mode is calm: what low pass and rate limiter make of a whole run in each, on a clock of its own.

`python -m pytest -n 0 -s tests/stations/test_command_modes.py` prints the table of docs/emulator.md.
"""

import numpy as np
import pytest

from riseg_drake.app.planned_speed import planned_limits
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.pushing.push import Push
from riseg_drake.pushing.push_path import PlannedSpeed, PushPathParameters, plan_push_path
from riseg_drake.pushing.pusher import Pusher
from riseg_drake.robot.command_stream import CommandParameters, TipGeometry
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics, observe_pose
from riseg_drake.robot.limits import ROBOTS
from tests.stations.driver_and_stream import DriverAndStream

INTERACTIONS = 5
CALM_ACCELERATION, CALM_AT_LIMIT = 0.3, 1e-3
"""What is asked of the mode that is used: acceleration, share of the limit, rms; share of ticks at a limit."""

MODES = {
    "positions at 200 Hz": ("position", 200.0, "kept awake"),
    "positions at 1 kHz": ("position", 1000.0, "kept awake"),
    "positions at 1 kHz, jitter": ("position", 1000.0, "jitter"),
    "velocities at 200 Hz": ("velocity", 200.0, "kept awake"),
    "velocities at 200 Hz, jitter": ("velocity", 200.0, "jitter"),
}

SLEEPS = {"kept awake": lambda rng: 0.0, "jitter": lambda rng: rng.exponential(3e-4)}
"""By how much a process sleeps too long, s. With a mean of 0.3 ms one in a thousand sleeps is 2 ms too long,
somewhat worse than `riseg bench --stream` measures."""


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
        path = plan_push_path(push, kinematics, q_observe, Pusher(), parameters)
        if path is not None:
            paths.append(path.trajectory)
    return q_observe, paths


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request):
    return (request.param, *planned_run(request.param))


def whole_run(name, q_observe, paths, mode, rate, sleep):
    tip = TipGeometry(lambda q: np.array([0.5, 0.0, 0.2]), lambda q: np.eye(6, 7))
    session = DriverAndStream(
        mode,
        ROBOTS[name],
        q_observe,
        CommandParameters(rate=rate),
        tip,
        wakes_late=SLEEPS[sleep],
    ).run(0.1)
    for path in paths:
        session.plan(path)
        session.run(path.end_time() + 1)
    session.run(1)
    assert session.driver.end is None, session.driver.end
    np.testing.assert_allclose(session.robot.q_d, q_observe, atol=2e-3)
    return session.driver.judge.verdict()


@pytest.mark.parametrize("how", MODES)
def test_a_whole_run(robot, how):
    verdict = whole_run(*robot, *MODES[how])
    print(f"\n{robot[0]}, {how}: {verdict}")
