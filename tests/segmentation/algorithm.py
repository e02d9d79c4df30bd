"""Alg. 2 from frame to frame without any system, for tests."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import NO_PAIR, Frame, FramePair
from riseg_drake.segmentation.above_table import AboveTable, AboveTableParameters, objects_above_table
from riseg_drake.segmentation.bfif import BFIFParameters, group_body_frames, no_groups
from riseg_drake.segmentation.expected_flow import expected_flow
from riseg_drake.segmentation.frame_pairs import FramePairParameters, next_pair
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.optical_flow import DisFlow, FlowMethod
from riseg_drake.segmentation.segment import Segmentation, SegmentParameters, nothing_segmented, segment
from riseg_drake.segmentation.segment_by_evidence import nothing_evident, segment_by_evidence


@dataclass
class Algorithm:
    """Takes frames one after the other, and remembers what the two memories of the diagram do."""

    bfif: BFIFParameters = field(default_factory=BFIFParameters)
    segment: SegmentParameters = field(default_factory=SegmentParameters)
    pairs: FramePairParameters = field(default_factory=FramePairParameters)
    flow: FlowMethod = field(default_factory=DisFlow)

    pair: FramePair = NO_PAIR
    groups: BFIFGroups = field(default_factory=no_groups)
    above: dict[int, AboveTable] = field(default_factory=dict)
    answer: Segmentation | None = None
    inputs: tuple = ()
    """What `segment` was given besides the mask before."""

    def take(self, frame: Frame, groups: BFIFGroups | None = None) -> Segmentation:
        """L_t for the next frame; with `groups` in place of those that are found, if given."""
        self.pair = next_pair(self.pair, frame, self.groups.flow_span, self.pairs)
        self.above[frame.sequence] = objects_above_table(frame, AboveTableParameters())
        above_0, above_1 = (self.above[f.sequence] for f in (self.pair.reference, self.pair.current))
        e_t = expected_flow(self.pair.reference.depth, self.pair.X_C1C0, frame.intrinsics)
        o_t = self.flow(self.pair.reference.color, frame.color)
        rng = np.random.default_rng([0, frame.sequence])
        self.groups = groups or group_body_frames(self.pair, e_t, o_t, above_0, self.bfif, rng)
        self.inputs = (self.pair, e_t, o_t, self.groups, above_0, above_1, self.segment, self.bfif)
        if self.segment.method == "evidence":
            before = self.answer or nothing_evident(frame.depth.shape)
            seen = (self.pair, self.groups, above_0, above_1)
            self.answer = segment_by_evidence(before, *seen, self.segment.evidence, self.bfif)
        else:
            before = self.answer or nothing_segmented(frame.depth.shape)
            self.answer = segment(before, *self.inputs)
        return self.answer


def stand_in_groups(
    pair_label_0: NDArray[np.uint16], depth_0: NDArray, ray: NDArray, motions_C0: dict[int, NDArray]
) -> BFIFGroups:
    """The groups that a perfect grouper finds: every tenth pixel of each moving body a seed."""
    pixel, group = [], []
    for g, number in enumerate(motions_C0):
        mine = np.argwhere(pair_label_0 == number)[::10]
        pixel.append(mine)
        group.append(np.full(len(mine), g))
    pixel, group = np.concatenate(pixel), np.concatenate(group)
    v, u = pixel.T
    K = len(pixel)
    return replace(
        no_groups(),
        pixel=pixel,
        V_S=np.zeros((K, 6)),
        covariance=np.tile(np.eye(6), (K, 1, 1)),
        group=group,
        motion_C0=np.array(list(motions_C0.values())),
        p_C0Q=ray[v, u].astype(float) * depth_0[v, u, None],
        flow_span=5.0,
    )
