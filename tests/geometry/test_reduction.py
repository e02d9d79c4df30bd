"""A reduced frame sees what the whole one does, of the same points in space, in fewer pixels."""

import gc
import weakref

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, back_project, project
from riseg_drake.geometry.reduction import enlarged, reduced, reduced_intrinsics
from riseg_drake.geometry.rgbd import Frame, FramePair

CAMERA = Intrinsics(64, 48, 61.0, 60.0, 31.2, 23.9)


def frame(intrinsics: Intrinsics = CAMERA, seed: int = 0) -> Frame:
    rng = np.random.default_rng(seed)
    return Frame(
        sequence=3,
        time=0.5,
        intrinsics=intrinsics,
        color=rng.integers(0, 256, (*intrinsics.shape, 3), np.uint8),
        depth=rng.uniform(0.4, 0.6, intrinsics.shape).astype(np.float32),
        X_WC=np.diag([1.0, -1.0, -1.0, 1.0]),
        robot=rng.uniform(size=intrinsics.shape) < 0.05,
        gain=1.1,
    )


def blocks(image: np.ndarray, n: int) -> np.ndarray:
    """[h, w, n * n, ...], the pixels of a whole image that each pixel of the reduced one covers."""
    h, w = image.shape[0] // n, image.shape[1] // n
    return (
        image[: h * n, : w * n]
        .reshape(h, n, w, n, *image.shape[2:])
        .swapaxes(1, 2)
        .reshape(h, w, n * n, *image.shape[2:])
    )


@pytest.mark.parametrize(("width", "n"), [(32, 2), (31, 2), (22, 2), (21, 3), (16, 4)])
def test_a_frame_is_reduced_by_as_much_as_leaves_no_fewer_pixels_than_asked_for(width: int, n: int) -> None:
    few = reduced(frame(), width)
    shapes = {few.intrinsics.shape, few.depth.shape, few.robot.shape, few.color.shape[:2]}
    assert shapes == {(48 // n, 64 // n)}
    assert few.reduction == n


@pytest.mark.parametrize("width", [0, 33, 64, 1000])
def test_a_frame_that_is_too_small_or_to_stay_whole_is_the_answer_itself(width: int) -> None:
    whole = frame()
    assert reduced(whole, width) is whole
    assert whole.whole is whole
    assert whole.reduction == 1


@pytest.mark.parametrize("width", [0, 32])
def test_frames_that_are_dropped_are_freed_at_once_without_a_search_for_cycles(width: int) -> None:
    seen = reduced(frame(), width)
    left = [weakref.ref(each) for each in (seen, seen.whole, seen.whole.whole)]
    assert seen.reduction == (2 if width else 1)
    gc.disable()
    try:
        del seen
        assert [each() for each in left] == [None] * 3
    finally:
        gc.enable()


@pytest.mark.parametrize("n", [2, 3, 4])
def test_colour_is_the_mean_depth_one_of_those_covered_and_the_robot_wherever_it_covers_any(n: int) -> None:
    whole = frame()
    few = reduced(whole, 64 // n)
    assert np.abs(few.color - blocks(whole.color, n).mean(2)).max() <= 0.51
    assert (blocks(whole.depth, n) == few.depth[..., None]).any(2).all()
    np.testing.assert_array_equal(few.robot, blocks(whole.robot, n).any(2))


def test_the_middle_of_what_a_pixel_covers_lies_on_the_same_ray() -> None:
    few = reduced_intrinsics(CAMERA, 2)
    p_CQ = back_project(np.ones(few.shape, np.float32), few)
    uv = project(p_CQ.astype(float), CAMERA)
    np.testing.assert_allclose(uv[5, 7], [7 * 2 + 0.5, 5 * 2 + 0.5], atol=1e-4)


def test_of_an_odd_number_of_pixels_the_last_row_and_column_are_dropped() -> None:
    odd = Intrinsics(65, 49, 61.0, 60.0, 31.2, 23.9)
    few = reduced(frame(odd), 32)
    assert few.depth.shape == (24, 32)
    assert few.whole.depth.shape == (49, 65)


def test_the_whole_frame_has_the_number_time_pose_and_gain_of_what_it_was_reduced_to() -> None:
    whole = frame()
    few = reduced(whole, 32)
    X_WC = np.eye(4)
    moved = Frame(**{**vars(few), "sequence": 8, "X_WC": X_WC, "gain": 0.9})
    assert moved.whole.depth is whole.depth
    assert moved.whole.intrinsics is CAMERA
    assert (moved.whole.sequence, moved.whole.time, moved.whole.gain) == (8, 0.5, 0.9)
    assert moved.whole.X_WC is X_WC
    pair = FramePair(few, moved, residual=0.2, span=3.0).whole
    assert pair.reference.depth is pair.current.depth is whole.depth
    assert (pair.residual, pair.span) == (0.2, 3.0)


def test_an_enlarged_mask_has_the_outlines_of_the_whole_depth_image() -> None:
    # A disc 5 cm high, at any place between the pixels, seen from 0.5 m: not a pixel of the whole is wrong.
    u, v = np.meshgrid(np.arange(64), np.arange(48))
    for middle in [(30.0, 22.0), (31.3, 23.9), (28.5, 20.5)]:
        disc = np.hypot(u - middle[0], v - middle[1]) < 14.2
        whole = frame()
        depth = np.where(disc, 0.45, 0.5).astype(np.float32)
        few = reduced(Frame(**{**vars(whole), "depth": depth}), 32)
        label = np.where(few.depth < 0.47, 7, 0).astype(np.uint16)
        np.testing.assert_array_equal(enlarged(label, few), np.where(disc, 7, 0))


def test_where_depth_tells_nothing_an_enlarged_label_is_that_of_the_pixel_which_covers_it() -> None:
    label = np.random.default_rng(0).integers(0, 3, (24, 32)).astype(np.uint16)
    flat = Frame(**{**vars(frame()), "depth": np.full((48, 64), 0.5, np.float32)})
    missing = Frame(**{**vars(frame()), "depth": np.zeros((48, 64), np.float32)})
    for whole in (flat, missing):
        few = reduced(whole, 32)
        np.testing.assert_array_equal(enlarged(label, few), label.repeat(2, 0).repeat(2, 1))
    np.testing.assert_array_equal(enlarged(label, Frame(**{**vars(flat), "depth": few.depth})), label)


def test_the_row_and_column_that_were_dropped_take_the_labels_beside_them() -> None:
    odd = Intrinsics(65, 49, 61.0, 60.0, 31.2, 23.9)
    few = reduced(Frame(**{**vars(frame(odd)), "depth": np.full((49, 65), 0.5, np.float32)}), 32)
    label = np.random.default_rng(0).integers(0, 3, (24, 32)).astype(np.uint16)
    found = enlarged(label, few)
    assert found.shape == (49, 65)
    np.testing.assert_array_equal(found[48], found[47])
    np.testing.assert_array_equal(found[:, 64], found[:, 63])
