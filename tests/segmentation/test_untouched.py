"""What was never touched is guessed from depth, apart from the mask."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.segmentation.partition import Margins
from riseg_drake.segmentation.propagation import UNKNOWN
from riseg_drake.segmentation.segmentation import nothing_segmented
from riseg_drake.segmentation.untouched import untouched_clusters
from tests.segmentation.drawn_scene import CAMERA, DrawnScene, looking_down, planar

SCENE = DrawnScene([(0.05, 0.05, 0.03), (0.06, 0.06, 0.05), (0.04, 0.04, 0.03)])
"""The first two touch, and differ by 2 cm in height."""
PLACES = [planar(-0.055, 0.0), planar(0.0, 0.0), planar(0.09, 0.0)]


def seen(known):
    """The scene where the boxes `known` have ids and the others have not moved yet, and the true labels."""
    frame, label = SCENE.frame(0, looking_down(), PLACES)
    mask = np.where(label > 0, np.where(np.isin(label, known), label, UNKNOWN), 0).astype(np.uint16)
    return replace(nothing_segmented(CAMERA.shape), label=mask, seen=frame, settled=2.0), label


def test_before_anything_moved_all_are_clusters_with_the_largest_first():
    segmentation, label = seen(known=())
    clusters = untouched_clusters(segmentation)
    for box, cluster in ((2, 1), (1, 2), (3, 3)):
        assert np.mean(clusters[label == box] == cluster) > 0.9  # steep sides are cut off
    assert not clusters[label == 0].any()
    assert not segmentation.mask.any()


def test_what_has_an_id_is_none_of_them():
    segmentation, label = seen(known=(2, 3))
    clusters = untouched_clusters(segmentation)
    assert set(np.unique(clusters)) == {0, 1}
    assert not clusters[label != 1].any()
    assert np.mean(clusters[label == 1] == 1) > 0.97


def test_one_is_as_unsure_as_an_id_without_any_margin():
    segmentation, _ = seen(known=())
    assert segmentation.untouched_confidence == pytest.approx(1 / (1 + np.e**2))
    assert (
        replace(segmentation, margins=Margins({4: 0.0}, {4: 0.0})).confidence[4]
        == segmentation.untouched_confidence
    )


def test_before_the_first_frame_there_is_none():
    assert not untouched_clusters(nothing_segmented(CAMERA.shape)).any()
