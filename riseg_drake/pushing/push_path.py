"""The arm's way for one push: over the things, down, forward, and back the way it came.

The tool stays upright all along, so the camera keeps looking straight down on the scene. The way back
retraces the way there in joint space: it needs no planning, ends exactly where it began, and leads
through space that was found free.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from pydrake.trajectories import PiecewisePolynomial

from riseg_drake.pushing.push import ArmPhase, Push
from riseg_drake.pushing.pusher import Pusher
from riseg_drake.pushing.time_law import SpeedLimits, minimum_jerk, rest_to_rest, steady_speed
from riseg_drake.robot.kinematics import PandaKinematics, tip_pointing_down


@dataclass
class PushPathParameters:
    """How the arm moves for a push."""

    push_speed: float = 0.02
    """Speed of the tip during the push, m/s: 2 cm take a second, 15 to 30 frames."""
    ramp_time: float = 0.25
    """The tip gathers and loses that speed in this time, s."""
    crossing_height: float = 0.02
    """Room below the tip when it crosses above the tallest object, m."""
    arm_room: float = 0.05
    """Objects must stay this much below the flange while the tip is down, m."""
    limits: SpeedLimits = field(default_factory=SpeedLimits)
    """Shares of the joints' limits that are used."""
    position_step: float = 0.015
    """Distance between poses at which the joint angles are solved for, m ..."""
    angle_step: float = 0.08
    """... and the angle between them, rad."""


@dataclass(frozen=True)
class PushPath:
    """Joint angles over time, from rest at the observation posture to rest there again."""

    trajectory: PiecewisePolynomial
    """[7], rad, over [0, duration] s; velocity and acceleration are continuous."""
    push_start: float
    """When the tip, lowered behind the object, starts to move forward, s."""
    push_end: float
    """When it is d_push beyond the contact, s."""

    @property
    def duration(self) -> float:
        """Of the whole interaction, s."""
        return float(self.trajectory.end_time())

    def position(self, time: float) -> NDArray[np.float64]:
        """Joint angles [7] at a time since the start; the end's beyond it."""
        clamped = min(max(time, 0.0), self.duration)
        return self.trajectory.value(clamped)[:, 0]

    def phase(self, time: float) -> ArmPhase:
        """What the arm does at a time since the start."""
        if time < self.push_start:
            return ArmPhase.APPROACH
        return ArmPhase.PUSH if time < self.push_end else ArmPhase.RETREAT


def plan_push_path(
    push: Push,
    kinematics: PandaKinematics,
    q_observe: NDArray,
    pusher: Pusher,
    parameters: PushPathParameters | None = None,
) -> PushPath | None:
    """The path of a push from the posture q_observe [7] and back to it; None where the arm cannot do it.

    Joint limits, table, and the arm's own parts are looked at along all of it. Objects need no look:
    what the bar sweeps at their height was found free on the map, and the rest goes on above them.
    """
    parameters = parameters or PushPathParameters()
    if push.tallest > pusher.length - parameters.arm_room:
        return None
    ahead_W = np.append(push.direction_W, 0.0)
    ground = push.p_WE[2] - push.tip_height
    crossing = max(ground + push.tallest + parameters.crossing_height, push.p_WE[2])
    above_W = np.append(push.p_WE[:2], crossing)
    X_WE = kinematics.X_WE(q_observe)
    observe_W, observe_yaw = X_WE[:3, 3], float(np.arctan2(X_WE[1, 0], X_WE[0, 0]))
    yaw = float(np.arctan2(push.direction_W[1], push.direction_W[0]))

    for turn in _turns(yaw - observe_yaw):
        legs = []
        q = np.asarray(q_observe, float)
        if observe_W[2] < crossing:  # up first, where it stands
            raised_W = np.append(observe_W[:2], crossing)
            legs.append(_Leg(observe_W, raised_W, observe_yaw, observe_yaw))
            legs.append(_Leg(raised_W, above_W, observe_yaw, observe_yaw + turn))
        else:
            legs.append(_Leg(observe_W, above_W, observe_yaw, observe_yaw + turn))
        legs.append(_Leg(above_W, push.p_WE, yaw, yaw))
        legs.append(_Leg(push.p_WE, push.p_WE + push.length * ahead_W, yaw, yaw))
        traced = []
        for leg in legs:
            waypoints = leg.trace(q, kinematics, parameters)
            if waypoints is None:
                break
            traced.append(waypoints)
            q = waypoints[-1]
        else:
            return _in_time(traced, push.length, parameters)
    return None


@dataclass(frozen=True)
class _Leg:
    """A straight piece of the tip's way, with the tool upright."""

    from_W: NDArray[np.float64]
    to_W: NDArray[np.float64]
    from_yaw: float
    to_yaw: float

    def trace(
        self, q_from: NDArray, kinematics: PandaKinematics, parameters: PushPathParameters
    ) -> NDArray[np.float64] | None:
        """Joint angles [N, 7] along it, the first q_from; None where the arm cannot follow."""
        steps = max(
            float(np.linalg.norm(self.to_W - self.from_W)) / parameters.position_step,
            abs(self.to_yaw - self.from_yaw) / parameters.angle_step,
            3,
        )
        shares = np.linspace(0, 1, int(np.ceil(steps)) + 1)[1:]
        poses = [
            tip_pointing_down(
                self.from_W + share * (self.to_W - self.from_W),
                self.from_yaw + share * (self.to_yaw - self.from_yaw),
            )
            for share in shares
        ]
        traced = kinematics.trace_ik(poses, q_from)
        return None if traced is None else np.vstack([q_from, *traced])


def _turns(angle: float) -> list[float]:
    """The same rotation, the short way and the long way round."""
    short = float(np.arctan2(np.sin(angle), np.cos(angle)))
    return [short, short - np.copysign(2 * np.pi, short)]


def _in_time(legs: list[NDArray], length: float, parameters: PushPathParameters) -> PushPath:
    """Time laws for legs of joint angles, of which the last is the push, and for the way back."""
    stroke_time = length / parameters.push_speed + parameters.ramp_time
    there = [rest_to_rest(leg, minimum_jerk, parameters.limits) for leg in legs[:-1]]
    stroke = rest_to_rest(
        legs[-1],
        steady_speed(parameters.ramp_time / stroke_time),
        parameters.limits,
        shortest=stroke_time,
    )
    back = [rest_to_rest(leg[::-1], minimum_jerk, parameters.limits) for leg in reversed(legs)]
    breaks = [0.0]
    trajectory: PiecewisePolynomial | None = None
    for piece in [*there, stroke, *back]:
        piece.shiftRight(breaks[-1])
        breaks.append(piece.end_time())
        if trajectory is None:
            trajectory = piece
        else:
            trajectory.ConcatenateInTime(piece)
    assert trajectory is not None
    return PushPath(trajectory, push_start=breaks[len(there)], push_end=breaks[len(there) + 1])
