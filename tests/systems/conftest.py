"""A drawn scene in which a box is pushed, and one pair of it with all that Alg. 2 makes of it."""

from dataclasses import dataclass

import numpy as np
import pytest

from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.segmentation.above_table import AboveTable, AboveTableParameters, objects_above_table
from riseg_drake.segmentation.bfif import BFIFParameters, group_body_frames
from riseg_drake.segmentation.expected_flow import expected_flow
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.optical_flow import DisFlow
from tests.segmentation.drawn_scene import DrawnScene, looking_down, planar


@dataclass(frozen=True)
class Payloads:
    """What goes over the wires of Alg. 2 for one pair."""

    pair: FramePair
    expected_flow: np.ndarray
    optical_flow: np.ndarray
    above_0: AboveTable
    above_1: AboveTable
    groups: BFIFGroups


@pytest.fixture(scope="session")
def drawn_frames() -> list[Frame]:
    """Eight frames: the first of two boxes is pushed, the camera drifts along x."""
    scene, rng = DrawnScene([(0.07, 0.06, 0.03), (0.06, 0.08, 0.05)]), np.random.default_rng(0)
    return [
        scene.frame(k, looking_down(0.001 * k), [planar(-0.05, 0.002 * k, 0.3), planar(0.06, 0.0)], rng)[0]
        for k in range(8)
    ]


@pytest.fixture(scope="session")
def payloads(drawn_frames: list[Frame]) -> Payloads:
    """Of the frames 0 and 2, with the generator that BFIFGrouper has for seed 0."""
    pair = FramePair(drawn_frames[0], drawn_frames[2])
    above_0, above_1 = (objects_above_table(f, AboveTableParameters()) for f in (pair.reference, pair.current))
    e_t = expected_flow(pair.reference.depth, pair.X_C1C0, pair.current.intrinsics)
    o_t = DisFlow()(pair.reference.color, pair.current.color)
    rng = np.random.default_rng([0, pair.current.sequence])
    groups = group_body_frames(pair, e_t, o_t, above_0, BFIFParameters(), rng)
    assert len(groups) == 1
    return Payloads(pair, e_t, o_t, above_0, above_1, groups)
