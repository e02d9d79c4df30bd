"""Objects out of sight: behind the robot, or out of the view, and back with the same id."""

from copy import copy

import numpy as np
import pytest

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.look import EvidenceParameters
from riseg_drake.segmentation.memory import draw_memory, moved_memory, remember
from riseg_drake.segmentation.propagation import UNKNOWN
from riseg_drake.segmentation.segment import SegmentParameters
from tests.segmentation.drawn_scene import (
    CAMERA,
    DrawnScene,
    intersection_over_union,
    looking_down,
    motion_seen_from,
    planar,
)
from tests.segmentation.watched import Watcher

SCENE = DrawnScene([(0.07, 0.06, 0.03), (0.06, 0.08, 0.05)])
PLACES = [planar(-0.05, 0.0, 0.3), planar(0.06, 0.0)]
AWAY = looking_down(0.4)


def seen_then_lost(motion_of=None):
    """Both boxes are seen with ids 3 and 4, then the camera looks elsewhere: what is remembered."""
    pair, label_0, _ = SCENE.pair((looking_down(), AWAY), (PLACES, PLACES))
    ids = np.select([label_0 == 1, label_0 == 2], [3, 4]).astype(np.uint16)
    return remember({}, pair, ids, motion_of or {}), pair.reference, ids


def test_what_leaves_the_view_is_remembered_where_it_is() -> None:
    memory, frame, ids = seen_then_lost()
    assert set(memory) == {3, 4}
    drawn = draw_memory(memory, frame)
    for a in (3, 4):
        assert intersection_over_union(drawn == a, ids == a) > 0.9


def test_what_stays_in_sight_and_what_nobody_knows_is_not_remembered() -> None:
    pair, label_0, _ = SCENE.pair((looking_down(), looking_down(0.01)), (PLACES, PLACES))
    assert remember({}, pair, label_0, {}) == {}
    lost, label_0, _ = SCENE.pair((looking_down(), AWAY), (PLACES, PLACES))
    assert remember({}, lost, np.where(label_0 > 0, UNKNOWN, np.uint16(0)), {}) == {}


def test_what_is_remembered_stays_so_until_it_is_seen() -> None:
    memory, frame, _ = seen_then_lost()
    nothing = np.zeros(CAMERA.shape, np.uint16)
    still_away, _, _ = SCENE.pair((AWAY, looking_down(0.42)), (PLACES, PLACES))
    assert set(remember(memory, still_away, nothing, {})) == {3, 4}
    assert remember(memory, FramePair(still_away.reference, frame), nothing, {}) == {}


def test_an_object_that_moved_on_its_way_out_is_remembered_where_it_went() -> None:
    there = planar(-0.04, 0.02, 0.4)
    memory, _, _ = seen_then_lost({3: motion_seen_from(looking_down(), PLACES[0], there)})
    frame, label = SCENE.frame(1, looking_down(), [there, PLACES[1]])
    assert intersection_over_union(draw_memory(memory, frame) == 3, label == 1) > 0.9


def test_moving_the_memory_moves_points_in_the_world() -> None:
    X_WC = looking_down(0.1, 0.2, tilt=0.2)
    before, after = planar(0.0, 0.0), planar(0.01, 0.02, 0.5)
    memory = {3: np.array([[0.0, 0.0, 0.03], [0.02, 0.0, 0.0]]), 4: np.array([[0.1, 0.1, 0.0]])}
    moved = moved_memory(memory, {3: motion_seen_from(X_WC, before, after)}, X_WC)
    c, s = np.cos(0.5), np.sin(0.5)
    np.testing.assert_allclose(
        moved[3], [[0.01, 0.02, 0.03], [0.01 + 0.02 * c, 0.02 + 0.02 * s, 0.0]], atol=1e-12
    )
    np.testing.assert_array_equal(moved[4], memory[4])


def test_nothing_is_drawn_where_the_object_is_no_longer() -> None:
    memory, _, _ = seen_then_lost()
    taken_away = [planar(1.0, 1.0), PLACES[1]]
    frame, label = SCENE.frame(1, looking_down(), taken_away)
    drawn = draw_memory(memory, frame)
    assert np.mean(drawn[label == 0] > 0) < 0.01
    assert intersection_over_union(drawn == 4, label == 2) > 0.9


class Watched:
    """Alg. 2 on a drawn scene in which the first box is pushed until it has an id, and then is seen anew.

    A third box stands where only a camera that has gone away sees it.
    """

    SCENE = DrawnScene([*SCENE.sizes, (0.05, 0.05, 0.04)])
    OTHERS = (PLACES[1], planar(0.4, 0.0))

    def __init__(self, memory: bool = True) -> None:
        self.watcher = Watcher(segment=SegmentParameters(evidence=EvidenceParameters(memory=memory)))
        self.rng, self.sequence = np.random.default_rng(0), 0
        for k in range(7):
            self.look(at=[planar(-0.05, 0.0018 * k, 0.3), *self.OTHERS])
        for _ in range(3):  # at rest, where it is decided what moved
            self.look()
        for x in (0.02, 0.04, 0.02, 0.0):  # so far that the reference frame is renewed
            self.look(x)
        (self.id,) = self.watcher.answer.segmentation.object_ids
        self.assert_it_is_seen()

    def copy(self) -> "Watched":
        """From here on, without a trace in this one."""
        other = copy(self)
        other.watcher = copy(self.watcher)
        other.rng = np.random.default_rng(1)
        return other

    def look(self, x: float = 0.0, robot: np.ndarray | None = None, at: list | None = None) -> None:
        self.places = at or self.places
        frame, self.label = self.SCENE.frame(self.sequence, looking_down(x), self.places, self.rng, robot)
        self.mask = self.watcher.take(frame).mask
        self.sequence += 1

    def assert_it_is_seen(self) -> None:
        """With its id, and the others with none."""
        assert self.watcher.answer.segmentation.object_ids == (self.id,)
        assert intersection_over_union(self.mask == self.id, self.label == 1) > 0.85
        assert np.mean(self.mask[self.label > 1] == 0) > 0.97


@pytest.fixture(scope="module")
def pushed_once() -> Watched:
    return Watched()


AWAY_AND_BACK = [0.06, 0.12, 0.18, 0.24, 0.32, 0.32, 0.24, 0.18, 0.12, 0.06, 0.0]


def test_an_object_that_leaves_the_view_comes_back_with_its_id(pushed_once: Watched) -> None:
    watched = pushed_once.copy()
    for x in AWAY_AND_BACK:
        watched.look(x)
        if x == 0.32:
            assert not watched.mask.any()
    watched.assert_it_is_seen()


def test_without_memory_it_comes_back_unknown() -> None:
    watched = Watched(memory=False)
    for x in AWAY_AND_BACK:
        watched.look(x)
    assert not watched.mask.any()


@pytest.mark.parametrize("share", [0.5, 1.0], ids=["half hidden", "hidden"])
def test_an_object_that_the_robot_hides_for_a_while_keeps_its_id(pushed_once: Watched, share: float) -> None:
    watched = pushed_once.copy()
    columns = np.nonzero(watched.label == 1)[1]
    robot = np.zeros(CAMERA.shape, bool)
    robot[:, columns.min() - 5 : int(columns.min() + share * np.ptp(columns)) + 5] = True
    # The camera moves meanwhile, so that the robot is in the reference frame, too.
    for x in (0.0, 0.02, 0.04, 0.02, 0.0):
        watched.look(x, robot)
        assert not watched.mask[robot].any()
    if share < 1:
        watched.assert_it_is_seen()
    watched.look(0.02)
    watched.look()
    watched.assert_it_is_seen()
