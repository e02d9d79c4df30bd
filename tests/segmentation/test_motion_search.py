"""From rest to rest: motions that nobody proposed are found."""

from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from riseg_drake.segmentation import motion_search
from riseg_drake.segmentation.belief import BeliefParameters
from riseg_drake.segmentation.likelihood import LikelihoodParameters, motion_costs, unexplained_parts
from riseg_drake.segmentation.missing_motion import Missed, missing_motion
from riseg_drake.segmentation.motion_search import (
    MotionSearchParameters,
    Search,
    SearchProblem,
    search_motions,
)
from riseg_drake.segmentation.observation import (
    ObservationParameters,
    bond_evidence,
    motion_posterior,
    observe,
)
from riseg_drake.segmentation.recognition import RecognitionParameters
from riseg_drake.segmentation.slides import slides
from tests.segmentation.drawn_scene import (
    Blank,
    DrawnScene,
    Texture,
    first_compared,
    flow_error,
    looking_down,
    motion_seen_from,
    planar,
    standing,
)

SIZES = [(0.08, 0.07, 0.03), (0.06, 0.08, 0.05), (0.05, 0.05, 0.04)]
PLACES = [planar(-0.07, 0.0), planar(0.0, 0.0), planar(0.055, 0.01)]
OVER = looking_down()
DEPTH_NOISE = 0.0023


def test_slides_are_turns_about_the_normal_through_the_centre_and_shifts_along_the_plane():
    normal, centre = np.array([0.0, -0.6, -0.8]), np.array([0.1, 0.2, 0.5])
    amounts = np.array([[0.01, -0.02, 0.3], [0.0, 0.0, 0.0], [0.03, 0.0, 0.0]])
    motions = slides(normal, centre, amounts)
    np.testing.assert_allclose(motions[1], np.eye(4), atol=1e-15)
    for X, (first, second, turn) in zip(motions, amounts, strict=True):
        moved = RigidTransform(X)
        assert moved.rotation().ToAngleAxis().angle() == pytest.approx(abs(turn))
        if turn:
            np.testing.assert_allclose(moved.rotation().ToAngleAxis().axis(), normal, atol=1e-9)
        shift = moved.multiply(centre) - centre
        assert shift @ normal == pytest.approx(0)
        assert np.linalg.norm(shift) == pytest.approx(np.hypot(first, second))
        assert RotationMatrix(X[:3, :3]).IsValid()


NONE = np.empty((0, 4, 4))


def in_motion(problem: SearchProblem, known_K: np.ndarray) -> np.ndarray:
    """What the first body that is asked in a frame in motion is found to have done."""
    return missing_motion(problem, known_K, Missed())[0]


class Moved:
    """Boxes before and after some of them have moved, with sensor noise."""

    def __init__(
        self, after: dict[int, tuple[float, float, float]], textures: list | None = None, recognised: int = 6
    ):
        self.parameters = MotionSearchParameters(recognition=RecognitionParameters(most=recognised))
        scene = DrawnScene(SIZES, textures=textures or [])
        poses = [planar(*after[k]) if k in after else X for k, X in enumerate(PLACES)]
        pair, self.label, label_1 = scene.pair((OVER, OVER), (PLACES, poses), np.random.default_rng(0))
        self.above = standing(pair.current, label_1 > 0)
        self.belief, self.compared = first_compared(pair, self.label)
        self.motions_K = {k: motion_seen_from(OVER, PLACES[k], poses[k]) for k in after}

    def search(self, *proposed: np.ndarray, search=search_motions) -> np.ndarray:
        return search(self.problem(), np.array(proposed).reshape(-1, 4, 4))

    def problem(self) -> SearchProblem:
        parameters = ObservationParameters()
        return SearchProblem(
            self.compared,
            self.above,
            np.vstack([self.belief.part[None], self.belief.finer]),
            parameters.motion_cost,
            self.parameters,
            parameters.likelihood,
            BeliefParameters().partition.area_min,
        )

    def error(self, k: int, found: np.ndarray) -> float:
        """Pixels by which the nearest found motion is wrong on a box."""
        return min(flow_error(self.compared, self.label == k + 1, X, self.motions_K[k]) for X in found)


FAR = {0: (-0.085, 0.018, 0.25), 2: (0.07, 0.04, -0.2)}


@pytest.mark.renders
def test_two_boxes_that_went_far_and_turned_are_both_found():
    moved = Moved(FAR)
    found = moved.search()
    assert moved.error(0, found) < 0.3
    assert moved.error(2, found) < 0.3


@pytest.mark.renders
def test_a_blank_box_is_found_by_its_outline_and_height():
    moved = Moved({0: (-0.085, 0.018, 0.25)}, [Blank(90.0), Texture(1), Texture(2)])
    # It went 17 pixels; within the rim of two pixels that nobody asks, its surface tells nothing.
    assert moved.error(0, moved.search()) < 2


@pytest.mark.renders
def test_where_nothing_moved_nothing_is_found():
    assert len(Moved({}).search()) == 0


@pytest.mark.renders
def test_what_was_seen_in_motion_is_taken_where_the_search_does_not_reach():
    moved = Moved({0: (-0.08, 0.1, 0.9)}, recognised=0)
    assert moved.error(0, np.array([np.eye(4), *moved.search()])) > 5
    assert moved.error(0, moved.search(moved.motions_K[0])) < 0.3
    # What is recognised is found all the same.
    assert Moved({0: (-0.08, 0.1, 0.9)}).error(0, Moved({0: (-0.08, 0.1, 0.9)}).search()) < 0.3


@pytest.mark.renders
def test_but_not_beside_a_motion_that_was_found():
    moved = Moved(FAR)
    assert len(moved.search(*moved.motions_K.values())) == len(moved.search()) == 2


@pytest.mark.renders
def test_a_motion_like_one_that_was_found_is_taken_for_a_whole_body_alone():
    """It differs by half a pixel; but a body that neither of two like it explains would fall in two."""
    moved = Moved(FAR)
    problem = moved.problem()
    search = Search(problem, np.array([moved.motions_K[0]]))
    like_it = moved.motions_K[0].copy()
    like_it[0, 3] += 0.0007
    body = moved.belief.part == moved.belief.part[0]
    motion = (problem.gain_min, like_it, motion_costs(moved.compared, like_it[None], problem.likelihood))
    assert not search.take(motion, body)
    assert search.take(motion, body, distinct=False)
    assert not search.take((0.99 * problem.gain_min, *motion[1:]), body, distinct=False)


BLANK = [Blank(90.0), Texture(1), Texture(2)]


@pytest.mark.renders
def test_in_motion_the_blank_box_that_no_group_proposes_is_found_and_nothing_else():
    moved = Moved({0: (-0.085, 0.018, 0.25)}, BLANK)
    found = moved.search(search=in_motion)
    assert len(found) == 1
    assert moved.error(0, found) < 2


@pytest.mark.renders
@pytest.mark.parametrize("k", [0, 2])
def test_in_motion_what_is_known_is_not_looked_for(k):
    moved = Moved(FAR)
    known = moved.motions_K[k]
    (found,) = moved.search(known, search=in_motion)
    assert moved.error(2 - k, found[None]) < 0.3
    assert len(moved.search(*moved.motions_K.values(), search=in_motion)) == 0


@pytest.mark.renders
@pytest.mark.parametrize("after", [{}, {0: (-0.069, 0.001, 0.0)}, {2: (0.056, 0.012, 0.0)}])
def test_in_motion_nothing_is_found_where_nothing_moves_or_by_less_than_a_step(after):
    assert len(Moved(after).search(search=in_motion)) == 0


@pytest.mark.renders
def test_in_motion_what_has_moved_by_less_than_a_step_keeps_nothing_else_from_being_found():
    # A print 3 mm out of place is missed more than a blank box that has gone 17 mm, and is asked first.
    moved = Moved({0: (-0.085, 0.008, 0.0), 2: (0.0575, 0.011, 0.0)}, BLANK)
    first, missed = missing_motion(moved.problem(), NONE, Missed())
    assert len(first) == 0
    assert missed.place == 0
    assert moved.error(2, missed.slight_K) < 2
    # All three boxes as one come next, then the blank one.
    second, missed = missing_motion(moved.problem(), NONE, missed)
    assert len(second) == 0
    assert missed.place == 1
    third, missed = missing_motion(moved.problem(), NONE, missed)
    assert moved.error(0, third) < 2
    assert missed.place == 0


@pytest.mark.renders
def test_in_motion_another_body_is_asked_in_each_frame_until_there_is_none_and_then_the_first_again():
    moved = Moved({0: (-0.085, 0.008, 0.0)}, BLANK)
    found, missed = missing_motion(moved.problem(), NONE, Missed())
    assert moved.error(0, found) < 2
    assert missed.place == 0
    found, missed = missing_motion(moved.problem(), NONE, Missed(place=2))
    assert len(found) == 0
    assert missed.place == 0


def test_the_one_motion_of_a_part_falls_short_of_the_best_of_each_superpixel():
    # Part 0: 3 by the first motion, 5 by the second. Part 1: nothing is missing by the second.
    nats = np.array([[0.0, 3.0, 4.0], [5.0, 0.0, 0.0]])
    np.testing.assert_array_equal(unexplained_parts(nats, np.array([0, 0, 1])), [3, 0])


@pytest.mark.renders
def test_boxes_get_their_motions_and_borders_inside_them_hold():
    moved = Moved(FAR)
    keyframe = moved.belief.keyframe
    belief = moved.belief
    seen = observe(
        moved.compared, belief.bond, belief.divisions, belief.shown, moved.search(), ObservationParameters()
    )
    truth = np.array(
        [
            np.bincount(moved.label[keyframe.image_of(np.arange(keyframe.count), -1) == s]).argmax()
            for s in range(keyframe.count)
        ]
    )
    assert len(seen.motions_K) == 3
    for k in (1, 2, 3):
        motions = seen.motion[truth == k]
        assert np.mean(motions == np.bincount(motions).argmax()) > 0.97
    a, b = keyframe.borders.T
    apart = truth[a] != truth[b]
    # Between two boxes most borders say all that they can: each side is four nats surer of its own motion.
    parameters = ObservationParameters()
    own = [np.bincount(seen.motion[truth == k]).argmax() for k in (1, 2, 3)]
    for k, other in ((1, 2), (2, 3)):
        between = (np.minimum(truth[a], truth[b]) == k) & (np.maximum(truth[a], truth[b]) == other)
        nats = np.full((len(seen.share), 2), LikelihoodParameters().superpixel_max)
        nats[own[k - 1], 0] = nats[own[other - 1], 1] = 0.0
        q = motion_posterior(nats, seen.share, parameters.outlier)
        most = bond_evidence(q, seen.share, np.array([[0, 1]]), parameters.stays, parameters.along)
        assert np.median(seen.evidence[between]) == pytest.approx(most[0], abs=0.1)
    # Standing still together, as the second does, says log 1 / 0.8, moving together log 1 / 0.2, less what
    # superpixels leave open.
    shared = [np.median(seen.evidence[~apart & (truth[a] == k)]) for k in (1, 2, 3)]
    assert shared == pytest.approx([np.log(1 / 0.2), np.log(1 / 0.8), np.log(1 / 0.2)], abs=0.3)
    assert shared[1] == pytest.approx(np.log(1 / 0.8), abs=0.05)


def test_bodies_that_no_motion_explains_are_asked_what_they_did_the_worst_first_each_once(monkeypatch):
    """Each superpixel is explained by one of two motions; of four bodies one is by one motion, too."""
    bodies = np.array([[1, 1, 0, 0, 0, 0], [0, 0, 1, 1, 0, 0], [0, 0, 0, 1, 1, 0], [0, 0, 0, 0, 1, 1]], bool)
    # By the first motion they fall short by 9, 24, 4 and 2, by the second by 8, 12, 16 and 11.
    nats = np.array([[9.0, 0, 20, 4, 0, 2], [0.0, 8, 0, 12, 4, 7]])
    asked, taken = [], []

    class Search:
        def __init__(self, problem, known_K):
            self.found = []
            still = np.zeros((1, 6))
            self.costs = SimpleNamespace(point_count=still[0], misfit=still, nats=lambda likelihood: nats)

        def densest_patch(self, among):
            return among, np.full(6, np.inf)

        def best_motion(self, patch, distance):
            asked.append((patch.tolist(), distance.tolist()))
            return f"motion {len(asked)}"

        def take(self, motion, patch, *, distinct=True):
            taken.append((motion, patch.tolist(), distinct))

    monkeypatch.setattr(motion_search, "Search", Search)
    monkeypatch.setattr(motion_search, "recognised_motions", lambda *_: [])
    problem = SimpleNamespace(
        compared=SimpleNamespace(keyframe=SimpleNamespace(count=6, area=np.ones(6))),
        above=SimpleNamespace(mask=None),
        possible_bodies=lambda: bodies,
        pixels_min=1.0,
        gain_min=4.0,
        parameters=MotionSearchParameters(),
        likelihood=SimpleNamespace(correlated_gray=1.0),
    )
    assert len(search_motions(problem, np.empty((0, 4, 4)))) == 0
    worst_first = bodies[[1, 0, 2]]  # 12, 8 and 4; 2 is less than a motion's price
    assert asked == [(b.tolist(), np.where(b, 0.0, np.inf).tolist()) for b in worst_first]
    assert taken == [(f"motion {k + 1}", b.tolist(), False) for k, b in enumerate(worst_first)]
