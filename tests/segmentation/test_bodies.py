"""The bodies of a keyframe, by what one frame says of a few superpixels."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.se3 import exp_se3, inverse, translation
from riseg_drake.segmentation import bodies as module
from riseg_drake.segmentation.belief import Belief, BeliefParameters
from riseg_drake.segmentation.bodies import (
    Bodies,
    bodies_of,
    confirmed,
    points_in_view,
    rebased,
    standing,
    unseen_kept,
)
from riseg_drake.segmentation.observation import Observation, ObservationParameters
from riseg_drake.segmentation.propagation import UNKNOWN


def test_how_bodies_had_moved_when_the_reference_was_taken_is_told_since_the_new_keyframe():
    X_WO, X_WN = (
        exp_se3(np.array([0.1, 0.2, 0.0, 0.0, 0.0, 0.6])),
        exp_se3(np.array([0.0, -0.1, 0.3, 0.1, 0.0, 0.5])),
    )
    rng = np.random.default_rng(0)
    # Poses in W of two bodies, of which the second stood still, at the old keyframe, then, and at the new one.
    X_WB = [exp_se3(0.1 * rng.normal(size=6)) for _ in range(3)]
    since_old = [inverse(X_WO) @ X @ inverse(X_WB[0]) @ X_WO for X in X_WB]
    body = np.array([4, 4, 7])
    motion, told_apart = np.array([1, 1, 0]), np.zeros((8, 8))
    then = Bodies(body, motion, np.array([np.eye(4), since_old[1]]), 8, told_apart, body)
    now = Bodies(body, motion, np.array([np.eye(4), since_old[2]]), 8, told_apart, body)
    old = SimpleNamespace(frame=SimpleNamespace(X_WC=X_WO), area=np.array([5, 5, 5]))
    new = SimpleNamespace(frame=SimpleNamespace(X_WC=X_WN), count=4)
    following = SimpleNamespace(keyframe=new, body=np.array([7, 4, 0, 4]), next_id=8, told=np.zeros((8, 8)))
    told = rebased(then, now, old, following)
    expected = inverse(X_WN) @ X_WB[1] @ inverse(X_WB[2]) @ X_WN  # from the new keyframe back to then
    for superpixel, motion in enumerate([np.eye(4), expected, np.eye(4), expected]):
        np.testing.assert_allclose(told.motions_K[told.motion[superpixel]], motion, atol=1e-12)
    at_the_keyframe = rebased(now, now, old, following)
    for X in at_the_keyframe.motions_K:
        np.testing.assert_allclose(X, np.eye(4), atol=1e-12)


STILL_AND_MOVED = np.array([np.eye(4), translation(np.array([0.02, 0, 0]))])


def a_row_of_four(body, next_id=3, across=(False, False, False), area=(100, 100, 100, 100)):
    """A belief of four superpixels in a row, of which the first two move and the others stand still."""
    keyframe = SimpleNamespace(
        count=4,
        borders=np.array([[0, 1], [1, 2], [2, 3]]),
        length=np.array([10.0, 20.0, 10.0]),
        area=np.array(area),
        across=np.array(across),
        pixels_per_metre=1.0,
    )
    belief = Belief(
        keyframe=keyframe,
        prior=np.array([2.0, -1, 2]),
        evidence=np.zeros(3),
        alike=np.zeros(3),
        inherited=np.zeros(3),
        body=np.array(body),
        next_id=next_id,
        told=np.zeros((next_id, next_id)),
        part=np.arange(4),
        shown=np.full(3, 3.0),
        finer=np.zeros((0, 4), int),
    )
    nats = np.array([[50.0, 50, 0, 0], [0, 0, 50, 50]])
    said = np.array([0.1, -0.2, 0.3])
    seen = Observation(
        STILL_AND_MOVED, np.array([1, 1, 0, 0]), nats, said, np.ones(4), np.full(2, 0.5), np.zeros(4, bool)
    )
    return belief, seen


def told(belief, seen, before=None):
    return bodies_of(belief, seen, before or standing(belief), BeliefParameters(), ObservationParameters())


def test_what_has_no_one_motion_speaks_against_the_border_between_its_parts_by_its_length():
    seen, bodies = told(*a_row_of_four([0, 0, 0, 0]))
    # One motion costs both parts 100 nats, of which 60 are free: 40 over 20 pixels of border.
    np.testing.assert_allclose(seen.evidence, [0.1, -0.2 - 2.0, 0.3])
    assert (bodies.motion.tolist(), bodies.body.tolist(), bodies.next_id) == ([1, 1, 0, 0], [3, 3, 0, 0], 4)
    np.testing.assert_array_equal(bodies.motions_K, STILL_AND_MOVED)


@pytest.mark.parametrize(("area", "kept"), [((100, 100, 101, 99), 1), ((100, 100, 100, 100), 0)])
def test_what_has_moved_before_by_more_than_half_of_its_area_is_a_body_though_it_stands_still(area, kept):
    _, bodies = told(*a_row_of_four([0, 0, 1, 0], area=area))
    assert bodies.body.tolist() == [3, 3, kept, kept]


@pytest.mark.parametrize(
    ("before", "latest", "next_id", "ids", "following"),
    [
        ([5, 5, 0, 0], [5, 5, 0, 0], 3, [5, 5, 0, 0], 6),  # it is what it was in the frame before
        ([0, 0, 0, 7], [0, 0, 0, 7], 3, [8, 8, 0, 0], 9),  # 7 is gone, and nobody else's
        ([0, 0, 0, 7], [0, 0, 0, 7], 9, [9, 9, 0, 0], 10),
        ([0, 0, 0, 7], [0, 0, 0, 0], 3, [8, 8, 0, 0], 9),  # what was one with something known is somebody, too
        ([0, 0, 0, 0], [5, 0, 0, 7], 3, [5, 5, 0, 0], 8),  # it was not seen to move in the frame before
        ([6, 0, 0, 0], [6, 5, 0, 0], 3, [6, 6, 0, 0], 7),  # the frame before comes first
    ],
)
def test_ids_are_those_of_the_frames_before_and_new_ones_nobodys(before, latest, next_id, ids, following):
    before, latest = np.array(before), np.array(latest)
    before = Bodies(before, np.zeros(4, int), STILL_AND_MOVED, 99, np.zeros((99, 99)), latest)
    _, bodies = told(*a_row_of_four([0, 0, 0, 0], next_id), before)
    assert (bodies.body.tolist(), bodies.next_id) == (ids, following)
    assert bodies.latest.tolist() == np.where(np.array(ids) > 0, ids, latest).tolist()


@pytest.mark.parametrize(
    ("latest", "following"),
    [
        ([1, 5, 0, 0], [1, 5, 0, 0]),  # what is one with the known 1 for now
        ([1, 0, 0, 0], [1, 1, 0, 0]),  # what never was anything else
        ([1, 5, 6, 0], [1, 5, 6, 0]),
    ],
)
def test_what_is_one_with_something_known_keeps_the_id_that_it_had_for_itself(latest, following):
    now = np.array([1, 1, 0, 0])
    before = Bodies(now, np.array([1, 1, 0, 0]), STILL_AND_MOVED, 7, np.zeros((7, 7)), np.array(latest))
    _, bodies = told(*a_row_of_four([1, 0, 0, 0]), before)
    assert bodies.body.tolist() == [1, 1, 0, 0]
    assert bodies.latest.tolist() == following


def test_across_a_gap_all_of_both_parts_says_what_they_are_and_elsewhere_each_superpixel(monkeypatch):
    monkeypatch.setattr(module, "evidence_of_parts", lambda *_: np.array([9.0, -3.0, 9.0]))
    seen, _ = told(*a_row_of_four([0, 0, 0, 0], across=(False, True, False)))
    np.testing.assert_allclose(seen.evidence, [0.1, -3.0 - 2.0, 0.3])


@pytest.mark.parametrize("remembers", [True, False])
def test_bodies_that_have_no_one_motion_are_told_apart_by_what_that_costs_and_stay_two(remembers):
    parameters = BeliefParameters(told=remembers)
    belief, seen = a_row_of_four([1, 1, 2, 2])
    _, bodies = bodies_of(belief, seen, standing(belief), parameters, ObservationParameters())
    # One motion costs both 100 nats, of which 60 are free.
    expected = np.zeros((3, 3))
    expected[1, 2] = expected[2, 1] = 40.0 * remembers
    np.testing.assert_array_equal(bodies.told, expected)
    # Later a picture in which nothing moves says that all is one: 2 + 1 + 2 nats, by 10 or 20 pixels of border.
    belief = replace(belief, prior=np.array([2.0, 1.0, 2.0]), told=bodies.told)
    seen = replace(seen, nats=np.zeros((2, 4)), evidence=np.zeros(3))
    _, bodies = bodies_of(belief, seen, standing(belief), parameters, ObservationParameters())
    assert len(np.unique(bodies.body)) == 1 + remembers


@pytest.mark.parametrize("forgets", [True, False])
def test_what_falls_off_its_body_is_no_more_held_apart_from_others_by_what_that_was(forgets):
    """The third of four was of the body of the first two, which is not the last one's; it stands as that."""
    belief, seen = a_row_of_four([1, 1, 1, 2])
    apart = np.zeros((3, 3))
    apart[1, 2] = apart[2, 1] = 90.0
    inherited = np.array([0.0, 0.0, -4.0])
    belief = replace(belief, evidence=inherited, inherited=inherited, told=apart)
    parameters = BeliefParameters(strangers=forgets)
    told, bodies = bodies_of(belief, seen, standing(belief), parameters, ObservationParameters())
    assert bodies.body.tolist() == ([1, 1, 2, 2] if forgets else [1, 1, 3, 2])
    assert told.strangers.tolist() == [False, False, forgets, False]


CAMERA = Intrinsics(100, 100, 100.0, 100.0, 0.0, 0.0)
"""At 1 m a pixel is a centimetre."""


def two_blocks(shift):
    """A keyframe of two blocks of 20 x 40 pixels at 1 m, columns 10 to 29 and 30 to 49, and how they moved:
    id 5 by `shift` along x, m; id 6 stands still."""
    v, u = (a.ravel() for a in np.mgrid[10:50, 10:50])
    keyframe = SimpleNamespace(
        frame=SimpleNamespace(intrinsics=CAMERA, X_WC=np.eye(4)),
        owner=(u >= 30).astype(int),
        points=SimpleNamespace(pixel=np.stack([v, u]), depth=np.ones(1600, np.float32)),
        area=np.array([800, 800]),
        pixels_per_metre=100.0,
    )
    motions = np.array([np.eye(4), translation(np.array([shift, 0, 0]))])
    body = np.array([5, 6])
    return keyframe, Bodies(body, np.array([1, 0]), motions, 7, np.zeros((7, 7)), body)


def a_view(X_WC=None, robot=None):
    hidden = np.zeros((100, 100), bool) if robot is None else robot
    return SimpleNamespace(intrinsics=CAMERA, X_WC=np.eye(4) if X_WC is None else X_WC, robot=hidden)


def test_points_in_view_are_where_their_bodies_have_gone_before_a_camera_that_has_moved():
    keyframe, bodies = two_blocks(0.35)
    frame = a_view(translation(np.array([0.05, -0.1, 0.0])))
    owner, at, inside = points_in_view(keyframe, bodies, frame)
    v, u = keyframe.points.pixel
    np.testing.assert_array_equal(owner, keyframe.owner)
    np.testing.assert_array_equal(at, np.stack([v + 10, u - 5 + np.where(owner == 0, 35, 0)], axis=1))
    assert inside.all()
    _, _, inside = points_in_view(keyframe, two_blocks(0.8)[1], frame)
    np.testing.assert_array_equal(inside, (owner == 1) | (u + 75 < 100))


def seen_elsewhere():
    """What another frame says: both are one, and stand still."""
    body = np.array([6, 6])
    return Bodies(body, np.zeros(2, int), np.eye(4)[None], 7, np.zeros((7, 7)), body)


@pytest.mark.parametrize(("least", "kept"), [(0.0399, False), (0.0401, True)])
def test_what_has_left_the_picture_but_for_less_than_is_asked_keeps_its_id_and_motion(least, kept):
    keyframe, before = two_blocks(0.8)  # 10 of its 20 columns are in the picture: 400 cm^2
    now = seen_elsewhere()
    told = unseen_kept(now, before, keyframe, a_view(), least)
    if not kept:
        assert told is now
        return
    np.testing.assert_array_equal(told.body, [5, 6])
    np.testing.assert_allclose(told.motions_K[told.motion], before.motions_K[[1, 0]], atol=0)
    np.testing.assert_array_equal(now.body, [6, 6])


def test_where_more_ids_were_known_before_all_that_is_known_of_them_has_room():
    keyframe, before = two_blocks(0.8)
    before = replace(before, body=np.array([5, 6]), next_id=11, told=np.ones((11, 11)), latest=np.array([9, 6]))
    now = replace(seen_elsewhere(), told=np.arange(49.0).reshape(7, 7))
    told = unseen_kept(now, before, keyframe, a_view(), 0.05)
    assert told.next_id == 11
    assert told.latest.tolist() == [9, 6]
    np.testing.assert_array_equal(told.told, np.pad(now.told, (0, 4)))


def test_what_is_behind_the_robot_keeps_its_motion_and_what_stands_still_has_none():
    keyframe, before = two_blocks(0.3)
    robot = np.zeros((100, 100), bool)
    robot[:, 40:60] = True  # where id 5 is now
    told = unseen_kept(seen_elsewhere(), before, keyframe, a_view(robot=robot), 1e-4)
    np.testing.assert_array_equal(told.body, [5, 6])
    robot[:, 40] = False  # 40 pixels
    assert unseen_kept(seen_elsewhere(), before, keyframe, a_view(robot=robot), 39e-4).body[0] == 6
    assert unseen_kept(seen_elsewhere(), before, keyframe, a_view(robot=robot), 41e-4).body[0] == 5
    robot[:] = True
    np.testing.assert_array_equal(
        unseen_kept(seen_elsewhere(), before, keyframe, a_view(robot=robot), 1e-4).body, [5, 6]
    )


@pytest.mark.parametrize(
    ("found_before", "least", "shown"), [(7, 4, [7, 6, 9]), (7, 5, [UNKNOWN, 6, 9]), (6, 4, [UNKNOWN, 6, 9])]
)
def test_a_new_id_is_shown_from_its_second_frame_on_where_enough_of_it_is_seen(found_before, least, shown):
    label = np.array([[7, 7, 6, 0], [7, 7, 9, UNKNOWN]], np.uint16)  # 9 is remembered
    now, still = np.array([7, 6]), np.zeros(2, int)
    bodies = Bodies(now, still, np.eye(4)[None], 8, np.zeros((8, 8)), now)
    before = replace(bodies, latest=np.array([found_before, 6]))
    expected = np.array([[shown[0], shown[0], 6, 0], [shown[0], shown[0], 9, UNKNOWN]])
    np.testing.assert_array_equal(confirmed(label, bodies, before, 7, least), expected)
    # What was decided about is shown at once, and however little of it is seen.
    np.testing.assert_array_equal(confirmed(label, bodies, before, 8, 100), label)
