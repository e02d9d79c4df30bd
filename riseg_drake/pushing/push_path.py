"""The arm's way for one push: over the things, down, forward, and back the way it came.

The tool is upright whenever it is low, so that the camera looks straight down on what is pushed; where the
observation posture holds it at an angle, it is set upright on the way over the things. The way back
retraces the way there in joint space: it needs no planning, ends exactly where it began, and leads
through space that was found free.
"""

from dataclasses import dataclass, field, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from pydrake.trajectories import PiecewisePolynomial
from scipy.spatial.transform import Rotation

from riseg_drake.pushing.arm_path import PushPath
from riseg_drake.pushing.decision import PathStage
from riseg_drake.pushing.push import Push
from riseg_drake.pushing.time_law import SpeedLimits, minimum_jerk, rest_to_rest, steady_speed
from riseg_drake.robot.kinematics import (
    LIMIT_MARGIN,
    MIN_CLEARANCE,
    PandaKinematics,
    pose_error,
    tip_pointing_down,
)
from riseg_drake.robot.limits import RobotLimits

LONGEST = 9.0
"""A path that takes longer than this, s, at the usual speed is no path: the arm has to wind itself around."""


@dataclass
class PlannedSpeed:
    """Shares of the robot's limits that planned motions use. What is left out follows from the station:
    from what its commands may use on a real robot, and SpeedLimits in simulation.
    """

    velocity: float | None = None
    acceleration: float | None = None
    jerk: float | None = None

    def limits(self, otherwise: SpeedLimits | None = None) -> SpeedLimits:
        """With `otherwise` (SpeedLimits() if None) where nothing is said."""
        otherwise = otherwise or SpeedLimits()
        return SpeedLimits(
            otherwise.velocity if self.velocity is None else self.velocity,
            otherwise.acceleration if self.acceleration is None else self.acceleration,
            otherwise.jerk if self.jerk is None else self.jerk,
        )


@dataclass
class PushPathParameters:
    """How the arm moves for a push."""

    push_speed: float = 0.02
    """Speed of the tip during the push, m/s: 2 cm take a second, 15 to 30 frames."""
    ramp_time: float = 0.25
    """The tip gathers and loses that speed in this time, s."""
    crossing_height: float = 0.02
    """Room below the tip when it crosses above the tallest object, m."""
    longest: float | None = None
    """A path that would take longer than this, s, is no path; None: LONGEST, and longer by as much as `limits`
    are lower than usual."""
    arm_room: float = 0.05
    """Objects must stay this much below the flange while the tip is down, m."""
    limits: PlannedSpeed = field(default_factory=PlannedSpeed)
    """How fast."""
    position_step: float = 0.015
    """Distance between poses at which the joint angles are solved for, m ..."""
    angle_step: float = 0.08
    """... and the angle between them, rad."""
    joint_step: float = 0.25
    """No joint may turn more than this between two of those poses, rad: beyond, it would be a leap."""
    postures: int = 4
    """Ways to hold the arm behind the object, unlike each other, from which the rest is tried."""
    min_clearance: float = MIN_CLEARANCE
    """Room that arm, tool and camera keep to the table and to each other, m; half the tip's height where that
    is less, so that low things can be pushed."""


def plan_push_path(
    push: Push,
    kinematics: PandaKinematics,
    q_observe: NDArray,
    parameters: PushPathParameters | None = None,
) -> PushPath | PathStage:
    """The path of a push from the posture q_observe [7] and back to it, or what the arm cannot do of it.

    Joint limits, table, and the arm's own parts are looked at along all of it. Objects need no look:
    what the tip sweeps at their height was found free on the map, and the rest goes on above them.
    """
    parameters = parameters or PushPathParameters()
    if push.tallest > kinematics.tool.length - parameters.arm_room:
        return PathStage.ROOM_BELOW_THE_FLANGE
    ahead_W = np.append(push.direction_W, 0.0)
    ground = push.p_WE[2] - push.tip_height
    crossing = max(ground + push.tallest + parameters.crossing_height, push.p_WE[2])
    X_WStart = tip_pointing_down(push.p_WE, push.yaw)
    X_WAbove = tip_pointing_down(np.append(push.p_WE[:2], crossing), push.yaw)
    X_WReached = tip_pointing_down(push.p_WE + push.length * ahead_W, push.yaw)
    low = replace(parameters, min_clearance=min(parameters.min_clearance, push.tip_height / 2))
    stroke_poses, climb_poses = (_between(X_WStart, X_W, 0.0, low) for X_W in (X_WReached, X_WAbove))

    def from_posture(q_start: NDArray) -> PushPath | PathStage:
        # From the push outwards: the posture for it is chosen first, the rest has to lead there.
        stroke = _trace(stroke_poses, q_start, kinematics, low)
        if stroke is None:
            return PathStage.STROKE
        climb = _trace(climb_poses, q_start, kinematics, low)
        if climb is None:
            return PathStage.DESCENT
        legs = _crossing(q_observe, climb[-1], crossing, kinematics, parameters)
        if legs is None:
            return PathStage.CROSSING
        limits = parameters.limits.limits()
        path = _in_time([*legs, climb[::-1], stroke], push.length, limits, kinematics.limits, parameters)
        longest = LONGEST * max(limits.slowness, 1.0) if parameters.longest is None else parameters.longest
        return path if path.duration <= longest else PathStage.DURATION

    failed = PathStage.POSTURE
    postures = kinematics.free_postures(X_WStart, q_observe, min_clearance=low.min_clearance)
    for q_start in islice(postures, parameters.postures):
        path = from_posture(q_start)
        if isinstance(path, PushPath):
            return path
        failed = path if failed is PathStage.POSTURE else failed
    return failed


def _crossing(
    q_observe: NDArray,
    q_above: NDArray,
    height: float,
    kinematics: PandaKinematics,
    parameters: PushPathParameters,
) -> list[NDArray[np.float64]] | None:
    """Joint angles [N, 7] of the legs from the observation posture to above the push, tip at `height`
    or higher; None where the arm cannot follow.
    """
    q_from, legs = np.asarray(q_observe, float), []
    X_WE = kinematics.X_WE(q_from)
    if X_WE[2, 3] < height:  # up first, as it stands
        X_WRaised = X_WE.copy()
        X_WRaised[2, 3] = height
        rise = _trace(_between(X_WE, X_WRaised, 0.0, parameters), q_from, kinematics, parameters)
        if rise is None:
            return None
        legs.append(rise)
        q_from, X_WE = rise[-1], X_WRaised
    # The same direction can be reached turning left or right; the joints' own way there tells which.
    way = q_from + np.linspace(0, 1, 13)[:, None] * (q_above - q_from)
    turn = float(np.diff(np.unwrap([_yaw(kinematics.X_WE(q)) for q in way])).sum())
    poses = _between(X_WE, kinematics.X_WE(q_above), turn, parameters)
    crossing = _lead(poses, q_from, q_above, kinematics, parameters)
    return None if crossing is None else [*legs, crossing]


def _between(
    X_WE0: NDArray, X_WE1: NDArray, turn: float, parameters: PushPathParameters
) -> list[NDArray[np.float64]]:
    """Poses X_WE on a straight way, without the first, while the tool turns by `turn`, rad, about the
    vertical and what it leans changes steadily.
    """
    p_WE0, p_WE1 = X_WE0[:3, 3], X_WE1[:3, 3]
    yaw = _yaw(X_WE0)
    lean, end_lean = (_lean(X_WE, at) for X_WE, at in ((X_WE0, yaw), (X_WE1, yaw + turn)))
    steps = max(
        float(np.linalg.norm(p_WE1 - p_WE0)) / parameters.position_step,
        (abs(turn) + float(np.linalg.norm(end_lean - lean))) / parameters.angle_step,
        3,
    )
    poses = []
    for share in np.linspace(0, 1, int(np.ceil(steps)) + 1)[1:]:
        X_WE = tip_pointing_down(p_WE0 + share * (p_WE1 - p_WE0), yaw + share * turn)
        X_WE[:3, :3] @= Rotation.from_rotvec(lean + share * (end_lean - lean)).as_matrix()
        poses.append(X_WE)
    return poses


def _lean(X_WE: NDArray, yaw: float) -> NDArray[np.float64]:
    """The rotation vector [3], in E, from the upright tool at a yaw to the tool at X_WE."""
    upright = tip_pointing_down(X_WE[:3, 3], yaw)[:3, :3]
    return Rotation.from_matrix(upright.T @ X_WE[:3, :3]).as_rotvec()


def _yaw(X_WE: NDArray) -> float:
    """The direction of E's x axis about W's z, rad."""
    return float(np.arctan2(X_WE[1, 0], X_WE[0, 0]))


def _trace(
    poses: list[NDArray], q_from: NDArray, kinematics: PandaKinematics, parameters: PushPathParameters
) -> NDArray[np.float64] | None:
    """Joint angles [N, 7] along poses, the first q_from; None where the arm cannot follow."""
    traced = kinematics.trace_ik(poses, q_from, min_clearance=parameters.min_clearance)
    return None if traced is None else np.vstack([q_from, *traced])


def _lead(
    poses: list[NDArray],
    q_from: NDArray,
    q_to: NDArray,
    kinematics: PandaKinematics,
    parameters: PushPathParameters,
) -> NDArray[np.float64] | None:
    """Joint angles [N, 7] along poses from q_from to q_to, which is at the last; None where there are none.

    Seven joints leave one freedom, which is to lead to q_to: each step sets out from a point on the
    straight line there in joint space, and moves from it to the pose by as little as it can.
    """
    led = [q_from]
    for left, pose in zip(range(len(poses), 0, -1), poses, strict=True):
        q = _nearest_posture(pose, led[-1] + (q_to - led[-1]) / left, kinematics)
        if (
            q is None
            or np.abs(q - led[-1]).max() > parameters.joint_step
            or not kinematics.limits.contains(q, LIMIT_MARGIN)
            or kinematics.clearance(q) < parameters.min_clearance
        ):
            return None
        led.append(q)
    return np.array(led)


def _nearest_posture(X_WE: NDArray, q: NDArray, kinematics: PandaKinematics) -> NDArray[np.float64] | None:
    """The posture [7] near q that has the tip at X_WE to 1 um and 1 urad, or None: Newton's method, each
    step the shortest one.
    """
    for _ in range(15):
        error = pose_error(kinematics.X_WE(q), X_WE)
        if np.abs(error).max() < 1e-6:
            return q
        q = q + np.linalg.lstsq(kinematics.tip_jacobian(q), error, rcond=1e-4)[0]
    return None


def _in_time(
    legs: list[NDArray], length: float, limits: SpeedLimits, robot: RobotLimits, parameters: PushPathParameters
) -> PushPath:
    """Time laws for legs of joint angles, of which the last is the push, and for the way back."""
    stroke_time = length / parameters.push_speed + parameters.ramp_time
    there = [rest_to_rest(leg, minimum_jerk, limits, robot) for leg in legs[:-1]]
    stroke = rest_to_rest(
        legs[-1],
        steady_speed(parameters.ramp_time / stroke_time),
        limits,
        robot,
        shortest=stroke_time,
    )
    back = [rest_to_rest(leg[::-1], minimum_jerk, limits, robot) for leg in reversed(legs)]
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
