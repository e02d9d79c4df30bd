"""How a stop is judged from the commands, by stops whose figures are known."""

import numpy as np
import pytest

from riseg_drake.app.bench.stop import NoMotionError, judged
from riseg_drake.robot.command_stream import CommandParameters
from riseg_drake.robot.limits import PANDA_LIMITS

PARAMETERS = CommandParameters()
ALLOWED = PARAMETERS.limits.stop_acceleration * PANDA_LIMITS.acceleration[0]


def commands(deceleration: float, speed: float = 0.4, cause: float = 1.0) -> list[tuple[float, np.ndarray]]:
    """Joint 1 goes at one speed, rad/s, and from the cause on ever slower, rad/s^2."""
    stamps = np.arange(400) / PARAMETERS.rate
    velocity = speed - deceleration * np.clip(stamps - cause, 0, speed / deceleration)
    return [(100 + t, np.array([v, 0, 0, 0, 0, 0, 0])) for t, v in zip(stamps, velocity, strict=True)]


@pytest.mark.parametrize("share", [0.3, 0.9, 1.5])
def test_time_and_acceleration_are_those_of_the_stop(share):
    stop = judged(commands(share * ALLOWED), 101.0, PARAMETERS, PANDA_LIMITS)
    assert stop.seconds == pytest.approx(0.4 / (share * ALLOWED), abs=2 / PARAMETERS.rate)
    assert stop.acceleration == pytest.approx(share, rel=0.05)


def test_a_command_that_was_lost_does_not_look_like_acceleration():
    sent = commands(0.5 * ALLOWED)
    del sent[100], sent[204]
    assert judged(sent, 101.0, PARAMETERS, PANDA_LIMITS).acceleration == pytest.approx(0.5, rel=0.1)


@pytest.mark.parametrize("cause", [100.5, 101.5])
def test_an_arm_that_stood_still_already_or_always_proves_nothing(cause):
    still = [(t, 0 * v) for t, v in commands(ALLOWED)] if cause < 101 else commands(ALLOWED)
    with pytest.raises(NoMotionError, match="did not move"):
        judged(still, cause, PARAMETERS, PANDA_LIMITS)
