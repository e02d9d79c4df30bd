"""Someone who shows Alg. 2 one frame after the other, for tests."""

from dataclasses import replace

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.algorithm import (
    SegmentedFrame,
    SegmentObjsParameters,
    no_frame_segmented,
    segment_objs,
)
from riseg_drake.segmentation.optical_flow import DisFlow


class Watcher:
    """Keeps the last answer of `segment_objs`."""

    def __init__(self, **parameters) -> None:
        """Parameters by the names of the lines that they belong to."""
        self.parameters = replace(SegmentObjsParameters(), **parameters)
        self.flow = DisFlow()
        self.answer: SegmentedFrame | None = None

    def take(self, frame: Frame) -> SegmentedFrame:
        """What is made of the next frame."""
        before = self.answer or no_frame_segmented(frame.depth.shape)
        self.answer = segment_objs(before, frame, self.flow, self.parameters)
        return self.answer
