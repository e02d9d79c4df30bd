"""The one memory of frames: (I_t-1, I_t, theta_t-1, theta_t) and what stands on the table in both."""

import math
from dataclasses import dataclass, field, replace

from riseg_drake.geometry.rgbd import NO_PAIR, Frame, FramePair, Immutable
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE, AboveTable
from riseg_drake.segmentation.camera_motion import CameraMotionParameters, PoseError, renewed_pose_error
from riseg_drake.segmentation.exposure import with_equal_exposure
from riseg_drake.segmentation.frame_pairs import FramePairParameters, next_pair


@dataclass(frozen=True)
class PassedOver:
    """A frame that was left out, as it shows no table: the hand before the lens, a tip too near for depth."""

    time: float = -math.inf
    """Of the frame, s; -inf: none was left out since the last that was taken."""
    why: str = ""


@dataclass(frozen=True)
class RememberedPair(Immutable):
    """The pair, and objMask of its two frames."""

    pair: FramePair = NO_PAIR
    above_0: AboveTable = NOTHING_ABOVE_TABLE
    above_1: AboveTable = NOTHING_ABOVE_TABLE
    pose_error: PoseError = field(default_factory=PoseError)
    """Of the camera's motion, as the table shows it."""
    passed_over: PassedOver = PassedOver()
    """The last frame, if it was."""


def with_frame(
    memory: RememberedPair,
    frame: Frame,
    above: AboveTable,
    flow_span: float,
    pairs: FramePairParameters,
    camera_motion: CameraMotionParameters,
    left: float = 0.0,
) -> RememberedPair:
    """The memory with one more frame, which gets the next number; the memory itself if the frame is not newer.

    Args:
        memory: before.
        frame: the newest one.
        above: its objMask.
        flow_span: effective flow found in the pair that is in memory, pixels.
        pairs: which frame is its partner.
        camera_motion: how the poses' error is estimated.
        left: `given_residual` of the pair that is in memory, pixels.
    """
    if frame.time <= memory.pair.current.time:  # as that of NO_FRAME always is
        return memory
    frame = replace(frame, sequence=memory.pair.current.sequence + 1)
    if memory.pair is NO_PAIR:
        return RememberedPair(next_pair(NO_PAIR, frame, 0.0, pairs), above, above, memory.pose_error)
    pair = with_equal_exposure(next_pair(memory.pair, frame, flow_span, pairs))
    above_0 = memory.above_0 if pair.reference is memory.pair.reference else memory.above_1
    error = renewed_pose_error(
        memory.pose_error, memory.pair.current, memory.above_1, pair.current, above, camera_motion, left
    )
    return RememberedPair(pair, above_0, above, error)
