"""The one memory of frames: who is whose partner, with which objMask."""

from dataclasses import replace

import numpy as np

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE
from riseg_drake.segmentation.camera_motion import CameraMotionParameters
from riseg_drake.segmentation.frame_pairs import FramePairParameters
from riseg_drake.segmentation.remembered_pair import RememberedPair, with_frame
from tests.segmentation.drawn_scene import looking_down

CAMERA = Intrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)


def frame(time: float, x: float = 0.0) -> Frame:
    shape = CAMERA.shape
    color, depth = np.full((*shape, 3), 90, np.uint8), np.full(shape, 0.5, np.float32)
    return Frame(-1, time, CAMERA, color, depth, looking_down(x), np.zeros(shape, bool))


def table(height: float = 0.0):
    return replace(NOTHING_ABOVE_TABLE, plane_W=np.array([0.0, 0.0, 1.0, -height]), distance=0.5)


def after(
    memory: RememberedPair, time: float, above, span: float = 0.0, x: float = 0.0, kind: str = "keyframe"
):
    pairs = FramePairParameters() if kind == "keyframe" else FramePairParameters(kind=kind)
    return with_frame(memory, frame(time, x), above, span, pairs, CameraMotionParameters())


def test_the_first_frame_is_its_own_partner_with_its_own_mask_and_number_0():
    above = table()
    memory = after(RememberedPair(), 3.0, above)
    assert memory.pair.reference is memory.pair.current
    assert memory.pair.current.sequence == 0
    assert memory.above_0 is memory.above_1 is above


def test_a_frame_that_is_not_newer_changes_nothing():
    memory = after(RememberedPair(), 3.0, table())
    assert after(memory, 3.0, table()) is memory
    assert after(memory, 2.9, table()) is memory
    assert after(memory, 3.001, table()) is not memory


def test_frames_are_counted_and_the_reference_keeps_its_mask_until_it_is_renewed():
    first, second, third = table(), table(), table()
    memory = after(after(RememberedPair(), 0.0, first), 0.1, second, kind="consecutive")
    assert (memory.pair.reference.sequence, memory.pair.current.sequence) == (0, 1)
    assert (memory.above_0 is first, memory.above_1 is second) == (True, True)
    memory = after(memory, 0.2, third, span=50.0, kind="consecutive")
    assert (memory.pair.reference.sequence, memory.pair.current.sequence) == (1, 2)
    assert (memory.above_0 is second, memory.above_1 is third) == (True, True)


def test_a_reference_that_stays_keeps_the_mask_of_its_own_frame():
    first = table()
    memory = after(after(RememberedPair(), 0.0, first), 0.1, table())
    memory = after(memory, 0.2, table(), span=1.0)
    assert memory.pair.reference.sequence == 0
    assert memory.above_0 is first


def test_the_poses_error_is_what_the_table_shows_from_one_frame_to_the_next():
    memory = after(after(RememberedPair(), 0.0, table()), 0.1, table(0.002), x=0.01)
    assert memory.pose_error.frames == 1
    np.testing.assert_allclose(memory.pose_error.height_squares, 0.002**2, rtol=1e-6)
    assert after(memory, 0.2, table(0.002), x=0.02).pose_error.height_squares < 0.002**2
