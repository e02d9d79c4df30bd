"""What has moved is followed by its own pixels: from where it was, and from what the groups propose."""

import numpy as np
import pytest

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.alignment import AlignmentParameters
from riseg_drake.segmentation.belief import Belief, BeliefParameters
from riseg_drake.segmentation.bfif import no_groups
from riseg_drake.segmentation.bodies import Bodies
from riseg_drake.segmentation.bodies import standing as still
from riseg_drake.segmentation.candidates import candidate_motions
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.motions import BFIFGroups, flow_difference
from riseg_drake.segmentation.next_keyframe import first_belief
from riseg_drake.segmentation.noise import MeasurementNoise
from tests.segmentation.drawn_scene import (
    CAMERA,
    DrawnScene,
    looking_down,
    motion_seen_from,
    planar,
    standing,
)

pytestmark = pytest.mark.renders

OVER = looking_down()
PLACES = [planar(-0.07, 0.0), planar(0.06, 0.0)]
BEFORE = planar(-0.064, 0.0)
DEPTH_NOISE = 0.0023
FOLLOWING = AlignmentParameters(rounds=5, turn=0.1, shift=0.01)


class Pushed:
    """The first box had moved to `BEFORE` when it was last seen, and is now elsewhere."""

    def __init__(self, now: np.ndarray) -> None:
        scene, rng = DrawnScene([(0.08, 0.07, 0.03), (0.06, 0.08, 0.05)]), np.random.default_rng(0)
        first, label = scene.frame(0, OVER, PLACES, rng)
        self.frame: Frame = scene.frame(2, OVER, [now, PLACES[1]], rng)[0]
        self.belief: Belief = first_belief(
            first, standing(first, label > 0), MeasurementNoise(), BeliefParameters()
        )
        keyframe = self.belief.keyframe
        owner = keyframe.image_of(np.arange(keyframe.count), -1)
        self.first = np.array([np.mean(label[owner == s] == 1) > 0.5 for s in range(keyframe.count)])
        body = self.first.astype(np.intp)
        self.X_before, self.X_now = (motion_seen_from(OVER, PLACES[0], X) for X in (BEFORE, now))
        motions_K = np.array([np.eye(4), self.X_before])
        self.before = Bodies(body, body, motions_K, 2, np.zeros((2, 2)), body)

    def candidates(self, groups: BFIFGroups, before: Bodies | None = None) -> np.ndarray:
        keyframe = self.belief.keyframe
        compared = Comparison(keyframe, self.frame, DEPTH_NOISE, view_error=0.01)
        bodies = before or self.before
        return candidate_motions(compared, keyframe.frame, groups, still(self.belief), bodies, 1.0, FOLLOWING)

    def error(self, motion: np.ndarray) -> float:
        """Pixels by which it is wrong on the box."""
        edges = self.belief.keyframe.edges
        return flow_difference(edges.p_C0Q[self.first[edges.piece]], motion, self.X_now, CAMERA.fx)


@pytest.mark.parametrize("now", [(-0.0625, 0.001, 0.03), (-0.064, 0.0, 0.0), (-0.0655, -0.001, -0.04)])
def test_what_has_moved_is_found_where_it_is_now_without_any_group(now: tuple[float, float, float]) -> None:
    pushed = Pushed(planar(*now))
    [found] = pushed.candidates(no_groups())
    assert pushed.error(found) < 0.25


def test_what_went_far_is_followed_from_where_a_group_says_it_went() -> None:
    pushed = Pushed(planar(-0.02, 0.03, 0.3))
    nearly = motion_seen_from(OVER, PLACES[0], planar(-0.022, 0.032, 0.27))
    assert pushed.error(nearly) > 1
    edges = pushed.belief.keyframe.edges
    seeds = edges.p_C0Q[pushed.first[edges.piece]][::10]
    groups = no_groups()
    groups = type(groups)(
        **{**vars(groups), "p_C0Q": seeds, "group": np.zeros(len(seeds), np.intp), "motion_C0": nearly[None]}
    )
    first, *_ = pushed.candidates(groups)
    assert pushed.error(first) < 0.25


def test_nothing_is_followed_before_anything_has_moved() -> None:
    pushed = Pushed(planar(-0.058, 0.0))
    assert len(pushed.candidates(no_groups(), still(pushed.belief))) == 0
