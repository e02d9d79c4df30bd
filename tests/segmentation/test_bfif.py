"""Lines 3 to 6 of Alg. 2 on rendered bodies whose motions are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.se3 import inverse, log_se3, move_points
from riseg_drake.segmentation import bfif
from riseg_drake.segmentation.above_table import AboveTableParameters, objects_above_table
from riseg_drake.segmentation.bfif import BFIFParameters, group_body_frames, no_groups
from riseg_drake.segmentation.body_frames import BodyFrameParameters
from riseg_drake.segmentation.expected_flow import expected_flow
from riseg_drake.segmentation.grouping import GroupingParameters
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.optical_flow import DisFlow

pytestmark = pytest.mark.renders


def grouped(seen, parameters: BFIFParameters | None = None, seed: int = 0) -> BFIFGroups:
    pair = seen.pair
    e_t = expected_flow(pair.reference.depth, pair.X_C1C0, pair.current.intrinsics)
    o_t = DisFlow()(pair.reference.color, pair.current.color)
    above_0 = objects_above_table(pair.reference, AboveTableParameters())
    rng = np.random.default_rng(seed)
    return group_body_frames(pair, e_t, o_t, above_0, parameters or BFIFParameters(), rng)


def bodies_of_groups(groups: BFIFGroups, label_0: np.ndarray) -> list[np.ndarray]:
    """For each group the true labels under its seeds."""
    under = label_0[tuple(groups.pixel.T)]
    return [under[groups.group == g] for g in range(len(groups))]


def motion_errors(found: np.ndarray, true: np.ndarray, seen, body: int) -> tuple[float, float]:
    """How far (m) the body's centre is put from where it is, and the error of the turn (rad)."""
    v, u = (int(k.mean()) for k in np.nonzero(seen.label_0 == body))
    frame = seen.pair.reference
    p = frame.depth[v, u] * rays(frame.intrinsics)[v, u].astype(float)
    away = np.linalg.norm(move_points(found, p) - move_points(true, p))
    return float(away), float(np.linalg.norm(log_se3(inverse(true) @ found)[:3]))


@pytest.mark.parametrize("seed", range(3))
def test_two_bodies_that_move_differently_are_exactly_two_groups(two_move, seed: int) -> None:
    groups = grouped(two_move, seed=seed)
    assert len(groups) == 2
    bodies = bodies_of_groups(groups, two_move.label_0)
    assert {int(np.median(under)) for under in bodies} == {1, 2}
    for under in bodies:
        assert len(under) >= 5
        assert np.mean(under == np.median(under)) > 0.95


def test_each_groups_motion_is_its_bodys(two_move) -> None:
    groups = grouped(two_move)
    for under, found in zip(bodies_of_groups(groups, two_move.label_0), groups.motion_C0, strict=True):
        body = int(np.median(under))
        away, turned = motion_errors(found, two_move.motion_C0[body], two_move, body)
        assert away < 1e-3
        assert turned < np.deg2rad(1.0)


def test_one_body_that_moves_beside_still_ones_is_one_group(one_moves) -> None:
    groups = grouped(one_moves)
    (under,) = bodies_of_groups(groups, one_moves.label_0)
    assert np.mean(under == 2) > 0.95
    away, turned = motion_errors(groups.motion_C0[0], one_moves.motion_C0[2], one_moves, 2)
    assert away < 1e-3
    assert turned < np.deg2rad(1.0)


def test_the_flow_span_is_what_the_body_really_moved(one_moves) -> None:
    X, pair = one_moves.motion_C0[2], one_moves.pair
    p = np.array([[0.0, 0.0, 0.37]])
    shift = np.linalg.norm((move_points(X, p) - p)[0, :2]) * pair.current.intrinsics.fx / 0.37
    assert grouped(one_moves).flow_span == pytest.approx(shift, rel=0.3)


def test_where_only_the_camera_moves_there_is_no_group(none_moves) -> None:
    groups = grouped(none_moves)
    assert len(groups) == 0
    assert groups.flow_span == 0


def test_the_same_generator_gives_the_same_groups(two_move) -> None:
    first, second = (grouped(two_move, seed=4) for _ in range(2))
    np.testing.assert_array_equal(first.group, second.group)
    np.testing.assert_array_equal(first.motion_C0, second.motion_C0)


def test_the_twists_are_those_of_the_bodies(two_move) -> None:
    groups = grouped(two_move)
    S = np.eye(4)
    S[:3, 3] = groups.p_C0S
    under = two_move.label_0[tuple(groups.pixel.T)]
    for body, X in two_move.motion_C0.items():
        mine = (under == body) & (groups.group >= 0)
        V = log_se3(inverse(S) @ X @ S)
        spread = np.sqrt(np.einsum("kii->ki", groups.covariance[mine]))
        z = np.abs(groups.V_S[mine] - V) / spread
        assert np.median(z) < 2


def literal(**frames) -> BFIFParameters:
    """What the paper says, with nothing added."""
    parameters = BFIFParameters(
        frames=BodyFrameParameters(kind="triplets", **frames),
        grouping=GroupingParameters(covariance="sample"),
    )
    return parameters


def test_the_papers_own_version_runs_and_finds_its_groups_on_what_moves(two_move) -> None:
    groups = grouped(two_move, literal())
    assert len(groups) == groups.group.max(initial=-1) + 1
    assert len(groups.pixel) > 20
    assert np.mean(np.isin(two_move.label_0[tuple(groups.pixel.T)], [1, 2])) > 0.9
    assert np.isfinite(groups.V_S).all()


def test_the_papers_own_version_finds_nothing_where_nothing_moves(none_moves) -> None:
    assert len(grouped(none_moves, literal())) == 0


def test_groups_that_turn_out_to_have_one_motion_are_one_with_the_motion_of_all(one_moves, monkeypatch) -> None:
    # The paper's clustering could have cut a body in two: here every second frame goes to another group.
    whole = grouped(one_moves)
    monkeypatch.setattr(bfif, "group_twists", lambda twists, _: np.arange(len(twists.V_S)) % 2)
    cut = grouped(one_moves)
    assert len(cut) == 1
    assert (cut.group == 0).all()
    under = one_moves.label_0[tuple(cut.pixel.T)]
    away, turned = motion_errors(cut.motion_C0[0], one_moves.motion_C0[2], one_moves, 2)
    assert np.mean(under == 2) > 0.9
    assert away < 1e-3
    assert turned < np.deg2rad(1.0)
    assert cut.flow_span == pytest.approx(whole.flow_span, rel=0.05)


def test_frames_that_no_rigid_motion_explains_are_those_beyond_so_many_times_the_usual_misfit() -> None:
    def kept(misfit, most):
        return bfif._on_one_body(SimpleNamespace(misfit=np.array(misfit)), most).tolist()

    assert kept([2.0, 4.0, 4.0, 11.9, 12.1], 3.0) == [True, True, True, True, False]
    # Where most fit better than noise would have it, noise is what is usual.
    assert kept([0.1, 0.2, 0.2, 2.9, 3.1], 3.0) == [True, True, True, True, False]


def test_no_groups_are_none_in_every_array() -> None:
    none = no_groups(0.7)
    shapes = [array.shape for array in (none.pixel, none.V_S, none.covariance, none.motion_C0, none.p_C0Q)]
    assert shapes == [(0, 2), (0, 6), (0, 6, 6), (0, 4, 4), (0, 3)]
    assert none.group.shape == (0,)
    assert (len(none), none.flow_span, no_groups().flow_span) == (0, 0.7, 0.0)
    np.testing.assert_array_equal(none.p_C0S, np.zeros(3))
