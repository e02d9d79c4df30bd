"""Line 7 to the letter, its growth against a search written as the paper writes it."""

from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.bfif import BFIFParameters, no_groups
from riseg_drake.segmentation.body_frames import BodyFrameParameters
from riseg_drake.segmentation.frame_pairs import FramePairParameters
from riseg_drake.segmentation.grouping import GroupingParameters
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.paper import (
    PaperParameters,
    grow_by_similar_flow,
    push_by_flow,
    segment_as_in_paper,
)
from riseg_drake.segmentation.segment import SegmentParameters
from riseg_drake.segmentation.segmentation import Segmentation, nothing_segmented
from tests.segmentation.drawn_scene import CAMERA, DrawnScene, looking_down, planar, standing
from tests.segmentation.watched import Watcher

SIMILAR = 0.35


def seeded(pixels: list[tuple[int, int]], groups: list[int]) -> BFIFGroups:
    """Groups that consist of seeds (v, u) alone."""
    motions = np.tile(np.eye(4), (1 + max(groups, default=-1), 1, 1))
    return replace(
        no_groups(),
        pixel=np.array(pixels, np.intp).reshape(-1, 2),
        group=np.array(groups, np.intp),
        motion_C0=motions,
    )


def searched(flow: np.ndarray, moving: np.ndarray, seed: tuple[int, int]) -> np.ndarray:
    """Breadth first from one seed over moving neighbours of similar flow."""
    reached = np.zeros(moving.shape, bool)
    reached[seed] = True
    queue = deque([seed])
    while queue:
        v, u = queue.popleft()
        for a, b in ((v - 1, u), (v + 1, u), (v, u - 1), (v, u + 1)):
            inside = 0 <= a < moving.shape[0] and 0 <= b < moving.shape[1]
            if not inside or reached[a, b] or not moving[a, b]:
                continue
            if np.linalg.norm(flow[a, b] - flow[v, u]) < SIMILAR:
                reached[a, b] = True
                queue.append((a, b))
    return reached


@pytest.mark.parametrize("draw", range(8))
def test_one_seed_grows_to_what_breadth_first_search_reaches(draw: int) -> None:
    rng = np.random.default_rng(draw)
    flow = rng.choice([0.0, 2.0], (24, 30, 1), p=[0.25, 0.75]) + rng.uniform(-0.1, 0.1, (24, 30, 2))
    moving = rng.uniform(size=(24, 30)) < 0.85
    flow[~moving & (rng.uniform(size=moving.shape) < 0.3)] = np.nan
    seed = tuple(np.argwhere(moving)[rng.integers(moving.sum())])
    grown = grow_by_similar_flow(flow, moving, seeded([seed], [0]), SIMILAR)
    np.testing.assert_array_equal(grown > 0, searched(flow, moving, seed))
    np.testing.assert_array_equal(np.unique(grown[grown > 0]), [1])


def test_flow_that_changes_gently_is_one_piece_however_much_it_changes() -> None:
    flow = np.stack(np.broadcast_arrays(np.arange(40) * 0.2, np.zeros((10, 1))), axis=-1)
    grown = grow_by_similar_flow(flow, np.ones((10, 40), bool), seeded([(3, 1)], [0]), SIMILAR)
    assert (grown == 1).all()


def test_two_bodies_that_touch_are_grown_apart_by_the_step_in_flow() -> None:
    flow = np.zeros((20, 40, 2))
    flow[:, :22, 0], flow[:, 22:, 1] = 2.0, 3.0
    seeds = seeded([(4, 4), (15, 10), (10, 35)], [1, 1, 0])
    grown = grow_by_similar_flow(flow, np.ones((20, 40), bool), seeds, SIMILAR)
    assert (grown[:, :22] == 2).all()
    assert (grown[:, 22:] == 1).all()


def test_a_piece_that_two_groups_claim_goes_to_the_nearest_seed() -> None:
    moving = np.ones((9, 40), bool)
    grown = grow_by_similar_flow(np.zeros((9, 40, 2)), moving, seeded([(4, 5), (4, 30)], [0, 1]), SIMILAR)
    assert (grown[:, :15] == 1).all()
    assert (grown[:, 21:] == 2).all()


def test_nothing_grows_without_a_seed_nor_from_a_seed_of_no_group() -> None:
    moving = np.ones((9, 12), bool)
    flow = np.zeros((9, 12, 2))
    assert not grow_by_similar_flow(flow, moving, seeded([], []), SIMILAR).any()
    assert not grow_by_similar_flow(flow, moving, seeded([(2, 2)], [-1]), SIMILAR).any()


def test_pushing_by_flow_moves_labels_by_whole_pixels_and_off_the_image() -> None:
    label = np.zeros((4, 6), np.uint16)
    label[1, 1], label[2, 5], label[0, 0] = 3, 4, 5
    flow = np.zeros((4, 6, 2), np.float32)
    flow[1, 1], flow[2, 5], flow[0, 0] = [2.4, 0.6], [1.0, 0.0], np.nan
    expected = np.zeros_like(label)
    expected[2, 3] = 3
    np.testing.assert_array_equal(push_by_flow(label, flow), expected)


class Line7:
    """A box seen twice from one place, as if half of it had moved by so many pixels to the right."""

    def __init__(self, shift: float = 3.0) -> None:
        scene = DrawnScene([(0.08, 0.06, 0.03)])
        frames = [scene.frame(k, looking_down(), [planar(0, 0)])[0] for k in range(3)]
        self.frames, self.box = frames, scene.frame(0, looking_down(), [planar(0, 0)])[1] > 0
        self.right = self.box & (np.arange(CAMERA.width) >= CAMERA.width // 2)
        self.flow = np.zeros((*CAMERA.shape, 2), np.float32)
        self.flow[self.right, 0] = shift
        self.still = np.zeros_like(self.flow)

    def take(self, before: Segmentation, t_0: int, t_1: int, flow: np.ndarray, groups: BFIFGroups):
        pair = FramePair(self.frames[t_0], self.frames[t_1])
        above_0 = standing(pair.reference, self.box)
        return segment_as_in_paper(before, pair, self.still, flow, groups, above_0, PaperParameters())

    @property
    def seed(self) -> BFIFGroups:
        v, u = np.argwhere(self.right)[len(np.argwhere(self.right)) // 2]
        return seeded([(v, u)], [0])


def test_a_group_gets_an_id_that_the_mask_does_not_have_where_it_has_gone() -> None:
    line = Line7()
    known = np.zeros(CAMERA.shape, np.uint16)
    known[line.box & ~line.right], known[0, :3] = 1, 2
    before = replace(nothing_segmented(CAMERA.shape), sequence=0, label=known)
    after = line.take(before, 0, 1, line.flow, line.seed)
    expected = known.copy()
    expected[np.roll(line.right, 3, axis=1)] = 3
    np.testing.assert_array_equal(after.mask, expected)
    assert after.sequence == 1
    assert after.object_ids == (1, 2, 3)


def test_without_groups_the_mask_is_the_one_before_pushed_on() -> None:
    line = Line7(shift=-2.0)
    before = replace(nothing_segmented(CAMERA.shape), sequence=0, label=line.right * np.uint16(7))
    after = line.take(before, 0, 1, line.flow, no_groups())
    np.testing.assert_array_equal(after.mask, np.roll(line.right, -2, axis=1) * np.uint16(7))


@pytest.mark.parametrize(("shift", "grows"), [(0.79, False), (0.81, True)])
def test_a_group_grows_over_flow_of_more_than_the_least_alone(shift, grows) -> None:
    line = Line7(shift)
    before = replace(nothing_segmented(CAMERA.shape), sequence=0)
    after = line.take(before, 0, 1, line.flow, line.seed)
    assert np.count_nonzero(after.mask) == (np.count_nonzero(line.right) if grows else 0)


def test_frames_between_t_minus_1_and_t_leave_no_trace() -> None:
    line = Line7()
    before = replace(nothing_segmented(CAMERA.shape), sequence=0, label=line.right * np.uint16(7))
    between = line.take(before, 0, 1, line.flow / 3, line.seed)
    after = line.take(between, 0, 2, line.flow, no_groups())
    np.testing.assert_array_equal(after.mask, line.take(before, 0, 2, line.flow, no_groups()).mask)
    # Once t is t-1 its mask is what counts.
    again = line.take(between, 1, 2, line.still, no_groups())
    np.testing.assert_array_equal(again.mask, between.mask)


@pytest.mark.renders
@pytest.mark.parametrize("step", [0.0, 0.2])
def test_the_papers_own_version_runs_and_labels_what_moves(pushed, step) -> None:
    literal = Watcher(
        bfif=BFIFParameters(
            frames=BodyFrameParameters(kind="triplets"),
            grouping=GroupingParameters(covariance="sample"),
        ),
        segment=SegmentParameters(method="paper"),
        frame_pair=FramePairParameters(kind="consecutive", step=step),
    )
    most = 0.0
    for frame, truth in pushed[:10]:
        mask = literal.take(frame).mask
        assert mask.dtype == np.uint16
        most = max(most, np.mean(mask[truth == 1] > 0))
    assert most > 0.5
    assert literal.answer.segmentation.object_ids
