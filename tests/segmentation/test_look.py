"""Poses along a chain of pairs: they agree with each other, and nothing changes within a pair."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.look import EvidenceParameters, Look, agreeing
from tests.segmentation.drawn_scene import DrawnScene, looking_down, planar, standing

SCENE, PLACES = DrawnScene([(0.07, 0.06, 0.03)]), [planar(0.0, 0.0)]
DRIFT = exp_se3(np.array([0.01, -0.02, 0.03, 0.004, -0.002, 0.005]))


@pytest.fixture(scope="module")
def look() -> Look:
    frames = [SCENE.frame(k, looking_down(0.02 * k), PLACES)[0] for k in range(2)]
    above = standing(frames[1], frames[1].depth < 0.44)
    return Look(
        FramePair(*frames, residual=0.1), above, lambda: replace(above), EvidenceParameters(), BFIFParameters()
    )


def heights(above: AboveTable, X_WC: np.ndarray) -> np.ndarray:
    """Of points before a camera, m above the table."""
    p_CQ = np.array([[0.0, 0.0, 0.45, 1.0], [0.1, -0.05, 0.4, 1.0]])
    return (p_CQ @ X_WC.T) @ above.plane_W


def test_a_reference_that_was_set_right_keeps_that_pose_and_takes_the_current_frame_along(look: Look) -> None:
    X_WC0 = DRIFT @ look.pair.reference.X_WC
    found = agreeing(look, {0: X_WC0, 1: np.eye(4)})
    np.testing.assert_array_equal(found.pair.reference.X_WC, X_WC0)
    np.testing.assert_allclose(found.pair.current.X_WC, DRIFT @ look.pair.current.X_WC, atol=1e-12)
    np.testing.assert_allclose(found.pair.X_C1C0, look.pair.X_C1C0, atol=1e-12)
    assert found.pair.current.color is look.pair.current.color


def test_the_table_goes_along_and_things_stay_as_high_above_it(look: Look) -> None:
    found = agreeing(look, {0: DRIFT @ look.pair.reference.X_WC})
    before = heights(look.above, look.pair.current.X_WC)
    for above in (found.above, found.whole_above):
        np.testing.assert_allclose(heights(above, found.pair.current.X_WC), before, atol=1e-12)
        assert above.mask is look.above.mask


@pytest.mark.parametrize("known", [{}, {5: DRIFT}, None], ids=["nothing", "other frames", "the same pose"])
def test_where_nothing_else_is_known_of_the_reference_all_stays_as_it_is(look: Look, known) -> None:
    poses = {0: look.pair.reference.X_WC.copy()} if known is None else known
    assert agreeing(look, poses) is look


def test_poses_that_are_exact_agree_as_they_are(look: Look) -> None:
    exact = replace(look, pair=replace(look.pair, residual=0.0))
    assert agreeing(exact, {0: DRIFT @ look.pair.reference.X_WC}) is exact


def test_the_whole_of_what_stands_there_is_looked_at_once_and_only_where_it_is_asked_for(look: Look) -> None:
    seen = []
    asked = replace(look, see_whole=lambda: seen.append(0) or look.above)
    moved = agreeing(asked, {0: DRIFT @ look.pair.reference.X_WC})
    assert seen == []
    assert moved.whole_above is moved.whole_above
    assert seen == [0]
