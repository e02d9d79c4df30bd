"""Alg. 2, SegmentObjs, as the paper lists it: from what is remembered and a new frame to the next mask.

The systems of `riseg_drake.systems` are these calls one by one, wired; whoever has frames and no diagram calls
`segment_objs`.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.reduction import reduced
from riseg_drake.geometry.rgbd import NO_PAIR, Frame, FramePair, Immutable
from riseg_drake.segmentation.above_table import AboveTable, AboveTableParameters, objects_above_table
from riseg_drake.segmentation.bfif import BFIFParameters, group_body_frames, no_groups
from riseg_drake.segmentation.camera_motion import CameraMotionParameters, settled_pair
from riseg_drake.segmentation.expected_flow import expected_flow
from riseg_drake.segmentation.frame_pairs import FramePairParameters
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.optical_flow import NO_FLOW, FlowMethod, flow_around
from riseg_drake.segmentation.remembered_pair import RememberedPair, with_frame
from riseg_drake.segmentation.segment import SegmentParameters, segment
from riseg_drake.segmentation.segmentation import Segmentation, nothing_segmented


@dataclass
class SegmentObjsParameters:
    """Those of every line; a scenario has them under the same names."""

    above_table: AboveTableParameters = field(default_factory=AboveTableParameters)
    frame_pair: FramePairParameters = field(default_factory=FramePairParameters)
    camera_motion: CameraMotionParameters = field(default_factory=CameraMotionParameters)
    bfif: BFIFParameters = field(default_factory=BFIFParameters)
    segment: SegmentParameters = field(default_factory=SegmentParameters)

    @property
    def width(self) -> int:
        """Pixels to a row of the frames that are worked with in motion; the literal paper's are whole: 0."""
        return 0 if self.segment.method == "paper" else self.frame_pair.width


@dataclass(frozen=True)
class SegmentedFrame(Immutable):
    """What Alg. 2 made of a frame, and all that it needs for the next one."""

    remembered: RememberedPair
    """The frames of t-1 and t, reduced, with their poses as they came, and objMask of both."""
    pair: FramePair
    """The same with what of their poses can be believed."""
    expected_flow: NDArray[np.float32]
    """E_t [h, w, 2], pixels of the reduced frame."""
    optical_flow: NDArray[np.float32]
    """O_t [h, w, 2], pixels of the reduced frame."""
    groups: BFIFGroups
    """G_t."""
    segmentation: Segmentation
    """L_t."""

    @property
    def above_0(self) -> AboveTable:
        """ObjMask at t-1."""
        return self.remembered.above_0

    @property
    def above_1(self) -> AboveTable:
        """ObjMask at t."""
        return self.remembered.above_1

    @property
    def mask(self) -> NDArray[np.uint16]:
        """L_t [H, W]: object ids, 0 = background."""
        return self.segmentation.mask


def no_frame_segmented(shape: tuple[int, int]) -> SegmentedFrame:
    """Before the first frame, with L_0 [H, W] (Alg. 1, line 3)."""
    return SegmentedFrame(RememberedPair(), NO_PAIR, NO_FLOW, NO_FLOW, no_groups(), nothing_segmented(shape))


def segment_objs(
    before: SegmentedFrame,
    frame: Frame,
    flow: FlowMethod,
    parameters: SegmentObjsParameters,
    seed: int = 0,
) -> SegmentedFrame:
    """SegmentObjs(I_t-1, I_t, theta_t-1, theta_t, L_t-1).

    Args:
        before: what it made of the frame before, `no_frame_segmented` for the first one.
        frame: I_t with what follows from theta_t; numbered anew, one after the other.
        flow: how line 2 is done.
        parameters: see there.
        seed: with the frame's number it seeds the draw of body frames.

    Returns:
        `before` itself if the frame is not newer than that.

    Raises:
        NoPlaneError: no table in the frame.
    """
    frame = reduced(frame, parameters.width)
    above = objects_above_table(frame, parameters.above_table)
    remembered = with_frame(
        before.remembered,
        frame,
        above,
        before.groups.flow_span,
        parameters.frame_pair,
        parameters.camera_motion,
        before.pair.given_residual,
    )
    if remembered is before.remembered:
        return before
    pair, above_0, above_1 = remembered.pair, remembered.above_0, remembered.above_1
    bfif = parameters.bfif

    # Line 2 comes first: what stands still in it tells how far theta is to be believed, for line 1.
    O_t = flow_around(above_0, pair, flow)
    pair = settled_pair(
        pair, O_t, above_0, above_1, remembered.pose_error, bfif.noise, parameters.camera_motion
    )
    E_t = expected_flow(pair.reference.depth, pair.X_C1C0, pair.current.intrinsics)
    # Lines 3 to 6: X_t, body frames, their twists, and groups of these.
    rng = np.random.default_rng([seed, pair.current.sequence])
    G_t = group_body_frames(pair, E_t, O_t, above_0, bfif, rng)

    def see_whole() -> AboveTable:
        return above if frame.source is None else objects_above_table(frame.source, parameters.above_table)

    # Line 7.
    L_t = segment(
        before.segmentation, pair, E_t, O_t, G_t, above_0, above_1, see_whole, parameters.segment, bfif
    )
    return SegmentedFrame(remembered, pair, E_t, O_t, G_t, L_t)
