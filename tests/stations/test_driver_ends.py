"""The driver ends in every phase of a run, as the real one does; a hand moves the arm; it is started anew.

Nothing is imitated here: the driver is the emulator's, the commands are the product's.
"""

import numpy as np
import pytest

from riseg_drake.pushing.time_law import SpeedLimits, minimum_jerk, rest_to_rest
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.robot.supervisor import Mode
from riseg_drake.stations.panda_driver import ABORTED, ENDED, KILLED
from tests.stations.driver_and_stream import DriverAndStream

THERE = READY + 0.5 * np.array([1, -1, 1, 1, -1, 1, 1])
STILL = 0.35  # s; status is old after 0.1 s, and no stop takes longer than 0.25 s


def way(q_from, q_to):
    limits = SpeedLimits(0.28, 0.24, 0.1)
    return rest_to_rest(np.linspace(q_from, q_to, 12), minimum_jerk, limits, PANDA_LIMITS)


def moving(session):
    session.plan(way(READY, THERE))
    session.run(1.6)
    assert np.abs(session.robot.v_d).max() > 0.2


def pushing(session):
    session.session.obey("contact", session.wall, session.wall + 10)
    moving(session)


def holding(session):
    session.plan(way(READY, READY))
    session.run(0.5)


def paused(session):
    moving(session)
    session.shows_pictures = False
    session.run(0.8)
    assert session.stream.state.mode is Mode.PAUSED
    session.shows_pictures = True


def stopped(session):
    moving(session)
    session.torque_external = np.full(7, 20.0)
    session.run(0.4)
    assert session.stream.state.mode is Mode.STOPPED
    session.torque_external = np.zeros(7)


def killed(session):
    session.driver.kill()
    return KILLED


def reflex(session):
    session.robot.enter_reflex("cartesian_reflex")
    return ENDED


def user_stop(session):
    session.robot.user_stop()
    return ABORTED


ENDS = {moving: killed, pushing: reflex, holding: user_stop, paused: killed, stopped: reflex}
"""Of each phase, one that the fast tests take; the others stand behind the mark."""
CASES = [("velocity", phase, end) for phase, end in ENDS.items()] + [("position", moving, reflex)]
ALL = [("velocity", phase, end) for phase in ENDS for end in (killed, reflex, user_stop)]
ALL += [("position", phase, reflex) for phase in ENDS]


@pytest.mark.parametrize(
    ("mode", "phase", "end"),
    [pytest.param(*case, marks=[] if case in CASES else pytest.mark.renders) for case in ALL],
)
def test_the_arm_stays_where_the_hand_left_it_until_the_operator_speaks(mode, phase, end):
    session = DriverAndStream(mode, startup=0.5).run(0.1)
    phase(session)
    code = end(session)
    session.run(STILL)
    assert session.driver.end.code == code
    dead = session.now
    session.guide(joint=0, angle=0.3)
    back = session.restart().now
    here = session.robot.q_d
    session.run(0.7)
    assert session.sent_since(dead) == []
    assert session.fastest(since=back) <= 0.01
    assert session.driver.end is None

    session.session.obey("abandon")
    session.session.obey("release")
    word = session.now
    session.run(0.1)
    first = session.sent_since(word)[0].values
    np.testing.assert_allclose(first, np.zeros(7) if mode == "velocity" else here, atol=1e-3)
    np.testing.assert_allclose(session.stream.position, here, atol=1e-3)
    session.session.obey("begin")
    path = way(here, here + 0.05)
    session.plan(path)
    session.run(path.end_time() + 1.5)
    np.testing.assert_allclose(session.robot.q_d, here + 0.05, atol=1e-3)
    assert session.fastest(since=word) <= 0.35 * PANDA_LIMITS.velocity.min()
