"""Clusters of depth, of surfaces whose size is known."""

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.depth_clusters import DepthClusterParameters, depth_clusters, large_segments

CAMERA = Intrinsics(64, 48, 80.0, 100.0, 32.0, 24.0)
V, U = np.mgrid[:48, :64]


def clusters(depth: np.ndarray, mask: np.ndarray | None = None, **parameters: float) -> np.ndarray:
    mask = np.ones(depth.shape, bool) if mask is None else mask
    return depth_clusters(depth.astype(np.float32), mask, CAMERA, DepthClusterParameters(**parameters))


def test_a_step_of_depth_parts_and_a_smaller_one_does_not():
    for step, number in ((0.0014, 1), (0.0016, 2)):
        assert clusters(0.5 + step * (U >= 40)).max() == number


def test_steps_part_along_both_axes_and_the_largest_cluster_is_the_first():
    label = clusters(0.5 + 0.01 * (U >= 40) + 0.02 * (V >= 36))
    # Of 40 and 24 columns and 36 and 12 rows.
    assert [label[0, 0], label[0, 50], label[40, 0], label[40, 50]] == [1, 2, 3, 4]
    assert [np.count_nonzero(label == k) for k in (1, 2, 3, 4)] == [40 * 36, 24 * 36, 40 * 12, 24 * 12]


def test_a_ramp_whose_pixels_differ_by_less_is_one():
    assert clusters(0.5 + 0.001 * U).max() == 1


def test_what_is_masked_out_or_without_depth_parts_and_is_no_cluster():
    depth = np.full((48, 64), 0.5)
    depth[:, 30] = 0
    label = clusters(depth, mask=V != 20)
    assert label.max() == 4
    assert not label[20].any()
    assert not label[:, 30].any()


@pytest.mark.parametrize("z", [0.4, 0.8])
def test_the_area_of_a_segment_is_that_of_its_pixels_at_their_depth(z):
    segment = np.where((U < 12) & (V < 10), 1, 0)
    depth = np.full((48, 64), z, np.float32)
    inside = segment > 0
    area = 12 * 10 * z**2 / (80.0 * 100.0)
    for least, kept in ((0.99 * area, True), (1.01 * area, False)):
        assert large_segments(segment, inside, depth, CAMERA, least).any() == kept


def test_small_segments_are_left_out_and_leave_no_gap_in_the_numbers():
    segment = np.where(U < 2, 5, np.where(U < 30, 9, 2))
    depth = np.full((48, 64), 0.5, np.float32)
    pixel = 0.25 / 8000
    label = large_segments(segment, np.ones(segment.shape, bool), depth, CAMERA, 100 * pixel)
    assert [label[0, 0], label[0, 10], label[0, 40]] == [0, 2, 1]
