"""When a keyframe is left: what stands there it does not show, on drawn boxes."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.segmentation.bodies import Bodies
from riseg_drake.segmentation.look import EvidenceParameters
from riseg_drake.segmentation.occasions import leaves_keyframe
from tests.segmentation.drawn_scene import DrawnScene, looking_down, motion_seen_from, planar, standing

SIZES = [(0.06, 0.06, 0.03)] * 3
PLACES = [planar(-0.12, 0.0), planar(0.0, 0.0), planar(0.12, 0.0)]
NOTHING = np.zeros((0, 4, 4))


def looks_at(poses, X_WC=None):
    """A frame of the boxes, and what stands there."""
    frame, label = DrawnScene(SIZES).frame(0, looking_down() if X_WC is None else X_WC, poses)
    return frame, standing(frame, label > 0)


def leaves(keyframe, now, motions_K=NOTHING, still_since=1.0):
    (frame_K, above_K), (frame, above) = keyframe, now
    covered = np.zeros(frame_K.depth.shape, bool)
    covered[above_K.mask] = True
    view = SimpleNamespace(frame=frame_K, above=above_K, covered=covered)
    motions = np.concatenate([np.eye(4)[None], motions_K])
    nothing = np.zeros(0, int)
    bodies = Bodies(nothing, nothing, motions, 1, np.zeros((1, 1)), nothing)
    seen = SimpleNamespace(views=(view,), still_since=still_since)
    look = SimpleNamespace(frame=frame, above=above, parameters=EvidenceParameters())
    return leaves_keyframe(seen, bodies, look)


@pytest.mark.renders
def test_the_keyframe_is_left_when_a_third_of_what_stands_there_is_not_in_it():
    near, all_three = looks_at(PLACES, looking_down(x=0.2, z=0.3)), looks_at(PLACES)
    assert leaves(near, all_three)
    assert not leaves(all_three, all_three)
    # What is shown hardly at all cannot follow: an arm's camera that is too near will be back.
    assert not leaves(all_three, near)


@pytest.mark.renders
def test_what_a_known_motion_took_there_the_keyframe_has_shown():
    moved = [planar(-0.12, 0.12), planar(0.0, 0.12), PLACES[2]]
    motion = motion_seen_from(looking_down(), PLACES[0], moved[0])
    before, now = looks_at(PLACES), looks_at(moved)
    assert leaves(before, now)
    assert not leaves(before, now, motion[None])
    # While it moves the table beside it counts as shown: the next rest says what came there.
    assert not leaves(before, now, still_since=None)
