"""How fast to go along a path of joint angles: from rest to rest, within the limits, smoothly."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.trajectories import PiecewisePolynomial
from scipy.interpolate import CubicSpline

from riseg_drake.robot.limits import RobotLimits

KNOT_INTERVAL = 0.01
"""Time between the knots of the finished trajectory, s."""

_SLOWEST = 1e-3  # rad/s; at the very end of a range no speed is left, and a motion still has to end

Profile = Callable[[NDArray], NDArray]
"""tau [N] in [0, 1] -> s, s', s'', s''' [4, N]: how much of the path is done, and its derivatives."""


@dataclass
class SpeedLimits:
    """Shares of the robot's limits that a motion may use; as they stand here in simulation."""

    velocity: float = 0.6
    acceleration: float = 0.5
    jerk: float = 0.25

    @property
    def slowness(self) -> float:
        """How much longer a motion takes at most than with the shares that stand here."""
        usual = SpeedLimits()
        return max(
            usual.velocity / self.velocity,
            (usual.acceleration / self.acceleration) ** (1 / 2),
            (usual.jerk / self.jerk) ** (1 / 3),
        )


def minimum_jerk(tau: NDArray) -> NDArray[np.float64]:
    """s = 10 tau^3 - 15 tau^4 + 6 tau^5 and its derivatives [4, N]: at rest, unaccelerated, at both ends."""
    return np.stack(
        [
            tau**3 * (10 - 15 * tau + 6 * tau**2),
            30 * tau**2 * (1 - tau) ** 2,
            60 * tau * (1 - tau) * (1 - 2 * tau),
            60 * (1 - 6 * tau + 6 * tau**2),
        ]
    )


def steady_speed(ramp: float) -> Profile:
    """A profile with one speed but for smooth ramps, each a share `ramp` (<= 0.5) of the time, at both ends.

    In a ramp the speed follows 3 x^2 - 2 x^3.
    """
    speed = 1.0 / (1.0 - ramp)

    def profile(tau: NDArray) -> NDArray[np.float64]:
        # The second half is the first one run backwards.
        late = tau > 0.5
        near = np.where(late, 1.0 - tau, tau)
        x = np.minimum(near / ramp, 1.0)
        s = speed * ramp * (x**3 - x**4 / 2) + speed * np.maximum(near - ramp, 0.0)
        ds = speed * (3 * x**2 - 2 * x**3)
        dds = np.where(near < ramp, speed / ramp * 6 * x * (1 - x), 0.0)
        ddds = np.where(near < ramp, speed / ramp**2 * (6 - 12 * x), 0.0)
        return np.stack([np.where(late, 1.0 - s, s), ds, np.where(late, -dds, dds), ddds])

    return profile


def rest_to_rest(
    waypoints: NDArray,
    profile: Profile,
    limits: SpeedLimits,
    robot: RobotLimits,
    *,
    fractions: NDArray | None = None,
    shortest: float = 0.0,
) -> PiecewisePolynomial:
    """The fastest motion through waypoints [N, 7] with a given profile that the limits allow.

    Slowing a motion down by a factor divides velocity by it, acceleration by its square and jerk by its
    cube, so one look at the motion over unit time says how long it must take.

    Args:
        waypoints: [N, 7], N >= 2, joint angles, rad.
        profile: how the path is gone through.
        limits: shares of the robot's limits.
        robot: what its joints can do, at each position of the path.
        fractions: [N], share of the path at which each waypoint lies, evenly spaced if None.
        shortest: least duration, s.

    Returns:
        A trajectory from time 0, at rest at both ends, with continuous acceleration.
    """
    waypoints = np.asarray(waypoints, float)
    if fractions is None:
        fractions = np.linspace(0, 1, len(waypoints))
    path = CubicSpline(fractions, waypoints)
    tau = np.linspace(0, 1, 201)
    s, ds, dds, ddds = profile(tau)[..., None]
    q_0, q_1, q_2, q_3 = (path(s[:, 0], order) for order in range(4))
    lowest, highest = robot.velocity_range(q_0)
    towards = np.maximum(np.where(q_1 * ds > 0, highest, -lowest), _SLOWEST)
    velocity = np.abs(q_1 * ds) / (limits.velocity * towards)
    acceleration = np.abs(q_2 * ds**2 + q_1 * dds) / (limits.acceleration * robot.acceleration)
    jerk = np.abs(q_3 * ds**3 + 3 * q_2 * ds * dds + q_1 * ddds) / (limits.jerk * robot.jerk)
    duration = max(velocity.max(), acceleration.max() ** 0.5, jerk.max() ** (1 / 3), shortest)
    knots = max(int(np.ceil(duration / KNOT_INTERVAL)), 4)
    tau = np.linspace(0, 1, knots + 1)
    rest = np.zeros((waypoints.shape[1], 1))
    return PiecewisePolynomial.CubicWithContinuousSecondDerivatives(
        tau * max(duration, 1e-3), path(profile(tau)[0]).T, rest, rest
    )
