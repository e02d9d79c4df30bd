import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.outline_error import (
    DRAWN,
    SEEN,
    draw_outline_error,
    outline_errors,
    outline_verdict,
    seen_arm,
    shift_between,
)

SHAPE = (240, 320)
VIEW = Intrinsics(SHAPE[1], SHAPE[0], 300.0, 300.0, 159.5, 119.5)


def arm(u=0, v=0, grown=0):
    """An arm that comes in at the picture's top, with a tool at its end, moved to the right and down."""
    area = np.zeros(SHAPE, bool)
    area[: 100 + v + grown, 120 + u - grown : 180 + u + grown] = True
    area[100 + v : 160 + v + grown, 145 + u - grown : 155 + u + grown] = True
    return area


def frame(drawn, seen, depth=1.0, number=0):
    """A picture of a wall at `depth`, m, with an arm 0.3 m before it."""
    image = np.where(seen, depth - 0.3, depth).astype(np.float32)
    return Frame(number, float(number), VIEW, np.full((*SHAPE, 3), 90, np.uint8), image, np.eye(4), drawn)


NOTHING = np.zeros(SHAPE, bool)


@pytest.mark.parametrize("shift", [(0, 0), (7, 0), (0, -5), (-11, 13)])
@pytest.mark.parametrize("grown", [0, 3])
def test_an_arm_that_is_seen_elsewhere_is_found_that_far_away(shift, grown):
    found = shift_between(arm(grown=grown), arm(*shift))
    # Where the drawn arm is broader than the seen one, the shift is known to the margin along the arm only.
    np.testing.assert_allclose(found, shift, atol=0.5 + grown)
    assert found[0] == pytest.approx(shift[0], abs=0.5)


def test_the_seen_arm_is_what_is_nearer_than_the_scene_without_it():
    without = frame(NOTHING, NOTHING)
    now = frame(arm(), arm())
    now.depth[200:, :] -= 0.04  # nearer by less than 3 cm and 2 % of the distance: noise, or a thing that moved
    np.testing.assert_array_equal(seen_arm(without, now), arm())


def test_what_has_no_depth_or_showed_the_arm_before_tells_nothing():
    without = frame(arm(), arm())
    assert not seen_arm(without, frame(arm(), arm())).any()
    blind = frame(arm(), arm())
    blind.depth[:] = 0
    assert not seen_arm(frame(NOTHING, NOTHING), blind).any()


def test_every_picture_after_the_first_in_which_the_arm_shows_is_compared():
    frames = [frame(NOTHING, NOTHING), frame(arm(), arm(4, 3)), frame(NOTHING, NOTHING), frame(arm(), NOTHING)]
    (error,) = outline_errors(frames)
    np.testing.assert_allclose(error.shift, [4, 3], atol=0.5)
    assert error.size == pytest.approx(5.0, abs=0.6)


@pytest.mark.parametrize(("shift", "words"), [((1, 1), "good"), ((3, 1), "usable"), ((4, 4), "bad")])
def test_the_verdict_is_the_median_over_the_pictures(shift, words):
    frames = [frame(NOTHING, NOTHING), frame(arm(), arm(30, 0)), *[frame(arm(), arm(*shift)) for _ in range(2)]]
    median, said = outline_verdict(outline_errors(frames))
    assert median == pytest.approx(np.hypot(*shift), abs=0.5)
    assert said.startswith(words)


def test_both_outlines_are_drawn_in_their_colours():
    (error,) = outline_errors([frame(NOTHING, NOTHING), frame(arm(), arm(12, 0))])
    picture = draw_outline_error(error)
    assert tuple(picture[50, 120]) == DRAWN
    assert tuple(picture[50, 132]) == SEEN
    assert tuple(picture[230, 10]) == (90, 90, 90)
