"""What a motion costs a superpixel, worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.camera import project
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.geometry.se3 import exp_se3, inverse
from riseg_drake.segmentation import likelihood
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.keyframe import Keyframe, KeyframeParameters, make_keyframe
from riseg_drake.segmentation.likelihood import Costs, LikelihoodParameters, motion_costs
from riseg_drake.segmentation.noise import MeasurementNoise
from tests.segmentation.drawn_scene import CAMERA, Blank, DrawnScene, looking_down, planar, standing

pytestmark = pytest.mark.renders

DEPTH_NOISE = 0.0023
"""Standard deviation of depth at 1 m, m."""
STILL = np.eye(4)[None]


@pytest.fixture(scope="module")
def plate() -> tuple[Keyframe, Frame]:
    """A blank box from above, without any noise."""
    frame, label = DrawnScene([(0.1, 0.1, 0.03)], textures=[Blank(120.0)]).frame(
        0, looking_down(), [planar(0, 0)]
    )
    above = standing(frame, label > 0)
    return make_keyframe(frame, above, MeasurementNoise(), KeyframeParameters()), frame


def costs(keyframe: Keyframe, frame: Frame, **parameters: float) -> np.ndarray:
    """Mean squared residuals of the superpixels that have points."""
    compared = Comparison(keyframe, frame, DEPTH_NOISE, view_error=0.01)
    misfit = motion_costs(compared, STILL, LikelihoodParameters(**parameters)).misfit[0]
    return misfit[np.bincount(keyframe.owner, minlength=keyframe.count) > 0]


def test_depth_counts_by_how_many_points_its_noise_is_alike_in(plate: tuple[Keyframe, Frame]) -> None:
    keyframe, frame = plate
    # Two standard deviations of the difference of two depths: squared residuals of 4.
    nearer = replace(frame, depth=frame.depth - np.float32(2 * np.sqrt(2) * DEPTH_NOISE) * frame.depth**2)
    for correlated, expected in ((3.0, 4.0), (6.0, 1 + 3 / 2), (14.0, 1 + 3 * 3 / 14)):
        # The spread is that at the depth which is expected; gray has no residual.
        np.testing.assert_allclose(costs(keyframe, nearer, correlated_depth=correlated), expected, rtol=1e-3)


def test_where_no_depth_is_it_costs_what_a_match_does(plate: tuple[Keyframe, Frame]) -> None:
    keyframe, frame = plate
    np.testing.assert_allclose(costs(keyframe, replace(frame, depth=np.zeros_like(frame.depth))), 1, atol=1e-3)


def test_light_has_one_price_a_superpixel(plate: tuple[Keyframe, Frame]) -> None:
    keyframe, frame = plate
    brighter = replace(frame, color=np.full_like(frame.color, 132))
    points = np.bincount(keyframe.owner, minlength=keyframe.count)
    points = points[points > 0]
    # 120 to 132: minimise n (132 - 120 f)^2 / 8 + c (f - 1)^2 over f, with c = 3 / 0.02^2 where nothing moves.
    c = 3 / 0.02**2
    f = (points * 120 * 132 / 8 + c) / (points * 120**2 / 8 + c)
    # Depth's residual is 0 and its share of a pixel's cost 3 / 14.
    expected = (132 - 120 * f) ** 2 / 8 / f**2 + c * (f - 1) ** 2 / points + 1 - 3 / 14
    # In the old light it would be 18 a pixel, of which 9 count: for the smallest superpixels that is less.
    found = costs(keyframe, brighter, shadow=np.inf)
    np.testing.assert_allclose(found, np.minimum(expected, 9 + 1 - 3 / 14), rtol=0.02)


@pytest.mark.parametrize("gray", [30, 60, 240])
def test_a_shadow_costs_a_superpixel_two_nats_whatever_it_darkens(
    plate: tuple[Keyframe, Frame], gray: int
) -> None:
    keyframe, frame = plate
    other_light = replace(frame, color=np.full_like(frame.color, gray))
    points = np.bincount(keyframe.owner, minlength=keyframe.count)
    points = points[points > 0]
    # 2 nats are 2 x 2 x 3 squared residuals of gray, as 3 points count as one.
    expected = np.minimum(12 / points, 9) + 1 - 3 / 14
    np.testing.assert_allclose(costs(keyframe, other_light), expected, rtol=1e-3)


@pytest.mark.parametrize("measured", [1 / 1.05, 1 / 1.025, 1.0, 1 / 0.975, 1 / 0.95, 0.9])
def test_what_stands_still_may_be_nearer_or_farther_than_measured_in_both_views(measured: float) -> None:
    scene = DrawnScene([(0.1, 0.1, 0.03)])
    frames = [scene.frame(n, looking_down(x), [planar(0, 0)])[0] for n, x in enumerate((0.0, 0.06))]
    near, aside = (replace(f, depth=f.depth * np.float32(measured)) for f in frames)
    above = standing(near, near.depth < measured * 0.44)
    keyframe = make_keyframe(near, above, MeasurementNoise(), KeyframeParameters())
    # Gray and depth as they should be: 0 and 1 - 3 / 14, and a little for interpolation.
    right = pytest.approx(1 - 3 / 14, abs=0.02)
    # 6 cm aside are 44 pixels; 2.5 % of them are a motion of 1.1.
    assert bool(np.median(costs(keyframe, aside, view_errors=0.0)) == right) is (measured == 1)
    # Five errors of 1 % are allowed, and 10 % are not.
    assert bool(np.median(costs(keyframe, aside)) == right) is (measured != 0.9)


def test_a_camera_that_stands_shows_nothing_of_how_depth_errs(plate: tuple[Keyframe, Frame]) -> None:
    keyframe, frame = plate
    np.testing.assert_array_equal(costs(keyframe, frame), costs(keyframe, frame, view_errors=0.0))


def test_nats_are_squared_residuals_by_what_is_usual_and_no_more_than_a_superpixel_may_say() -> None:
    # 12 points count as 4, half of each squared residual; what is usual is 2, up to 3 may be by chance.
    misfit, points = np.array([[2.0, 2.0, 3.5], [2.5, 4.0, 2.0]]), np.array([12.0, 12.0, 12.0])
    seen = np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(3)
    nats = Costs(misfit, points, *seen).nats(LikelihoodParameters())
    np.testing.assert_allclose(nats, [[0, 0, 0.5 * 2], [0, 1.0 * 2, 0]])
    twice = Costs(misfit, 100 * points, *seen).nats(LikelihoodParameters())
    np.testing.assert_allclose(twice, [[0, 0, 4], [0, 4, 0]])


def test_excess_is_what_no_motion_explains_beyond_what_may_be_by_chance() -> None:
    # As above, but against a motion that is right; the third is explained by neither, the fourth says too much.
    misfit, points = np.array([[2.0, 2.0, 5.0, 18.0], [2.5, 4.0, 4.0, 2.0]]), np.full(4, 12.0)
    excess = Costs(misfit, points, *np.zeros((2, 2, 4)), np.zeros(4)).excess(LikelihoodParameters())
    np.testing.assert_allclose(excess, [[0, 0, 2.0 * 2, 4], [0, 1.0 * 2, 1.0 * 2, 0]])


def test_what_a_motion_hides_is_no_match_but_worse_by_what_is_usual() -> None:
    # The second motion hides half of it. What is usual is 2: half of that, for 12 points that count as 4.
    misfit, points = np.array([[2.5], [2.0]]), np.array([12.0])
    costs = Costs(misfit, points, np.array([[0.0], [0.5]]), np.zeros((2, 1)), np.zeros(1))
    np.testing.assert_allclose(costs.nats(LikelihoodParameters()), [[0], [0.5 * 2 * 12 / 3 / 2]])
    np.testing.assert_array_equal(costs.nats(LikelihoodParameters(hidden=0.0)), [[0], [0]])


def test_what_goes_behind_something_is_hardly_worse_than_a_match_by_a_motion_that_is_known() -> None:
    # Half of it: 0.15 of what is usual, 2, for 12 points that count as 4; a match with 2.5 is usual itself.
    misfit, points = np.array([[2.5], [2.0], [2.0]]), np.array([12.0])
    covered = np.array([[0.0], [0.5], [1.0]])
    costs = Costs(misfit, points, np.zeros((3, 1)), covered, np.zeros(1))
    known = costs.nats(LikelihoodParameters(), which=np.array([0, 1]))
    np.testing.assert_allclose(known, [[0], [0.5 * 0.15 * 2 * 12 / 3 / 2]])
    # Of what is only asked about, it counts as what is hidden.
    np.testing.assert_allclose(costs.nats(LikelihoodParameters()), [[0], [0.5 * 2 * 12 / 3 / 2], [4]])
    np.testing.assert_allclose(costs.excess(LikelihoodParameters()), [[0], [0.5 * 2 * 12 / 3 / 2], [4]])


def test_what_is_covered_counts_as_what_is_usual_however_little_noise_there_is() -> None:
    # Three superpixels match with 1.0 where 2 was thought usual; the fourth is covered and counts as 2.
    misfit, points = np.array([[1.0, 1.0, 1.0, 2.0], [9.0, 9.0, 9.0, 1.0]]), np.full(4, 12.0)
    covered = np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    costs = Costs(misfit, points, np.zeros((2, 4)), covered, np.zeros(4))
    nats = costs.nats(LikelihoodParameters(), which=np.array([0, 1]))
    np.testing.assert_allclose(nats[:, 3], [0.15 * 12 / 3 / 2, 0])


def test_what_cannot_be_compared_is_missed_by_no_motion_however_little_noise_there_is() -> None:
    # Three superpixels match with 1.0 where 2 was thought usual; the fourth left the view and counts as 2.
    misfit, points = np.array([[1.0, 1.0, 1.0, 2.0]]), np.full(4, 12.0)
    lost = np.array([[0.0, 0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(
        Costs(misfit, points, lost, 0 * lost, lost[0]).excess(LikelihoodParameters()), 0
    )
    # Half of it in view, and that wrong: 0.5 x 2 + 0.5 x 9, where 0.5 x 1 + 0.5 x 9 is meant.
    misfit[0, 3], lost[0, 3] = 5.5, 0.5
    excess = Costs(misfit, points, lost, 0 * lost, lost[0]).excess(LikelihoodParameters(superpixel_max=99.0))
    np.testing.assert_allclose(excess[0], [0, 0, 0, (5.0 - 1.5) * 12 / 3 / 2])


def test_what_is_behind_the_robot_or_outside_the_image_is_hidden(plate: tuple[Keyframe, Frame]) -> None:
    keyframe, frame = plate
    behind = replace(frame, robot=np.ones_like(frame.robot))
    aside = np.eye(4)
    aside[0, 3] = 1.0
    for seen, motion in ((behind, np.eye(4)), (frame, aside)):
        compared = Comparison(keyframe, seen, DEPTH_NOISE, view_error=0.01)
        hidden = motion_costs(compared, motion[None], LikelihoodParameters()).hidden[0]
        np.testing.assert_array_equal(hidden, np.bincount(keyframe.owner, minlength=keyframe.count) > 0)
    compared = Comparison(keyframe, frame, DEPTH_NOISE, view_error=0.01)
    np.testing.assert_array_equal(motion_costs(compared, STILL, LikelihoodParameters()).hidden, 0)


def test_what_leaves_the_image_by_the_cameras_own_motion_is_not_hidden(plate: tuple[Keyframe, Frame]) -> None:
    keyframe, _ = plate
    away = DrawnScene([(0.1, 0.1, 0.03)], textures=[Blank(120.0)]).frame(1, looking_down(1.0), [planar(0, 0)])
    back = np.eye(4)
    back[0, 3] = 1.0  # as the camera: it would be where it was in the image
    compared = Comparison(keyframe, away[0], DEPTH_NOISE, view_error=0.01)
    hidden = motion_costs(compared, np.array([np.eye(4), back]), LikelihoodParameters()).hidden
    np.testing.assert_array_equal(hidden, 0)


@pytest.mark.parametrize("aside", [0.0, 0.03], ids=["the same view", "another view"])
@pytest.mark.parametrize("stood", [True, False], ids=["stood there", "came there"])
def test_a_tile_that_slides_under_a_rim_is_covered_by_what_stood_there_alone(aside: float, stood: bool) -> None:
    """By 2 cm; the rim, 6 cm above the table, hides a strip of it that was in sight."""
    scene = DrawnScene([(0.1, 0.08, 0.008), (0.06, 0.1, 0.06)])
    X_WK, rim = looking_down(), planar(0.09, 0.0)
    first, label = scene.frame(0, X_WK, [planar(0, 0), rim if stood else planar(0.09, 0.3)])
    second, after = scene.frame(1, looking_down(aside), [planar(0.02, 0), rim])
    above = standing(first, label > 0)
    keyframe = make_keyframe(first, above, MeasurementNoise(), KeyframeParameters())
    motion = inverse(X_WK) @ planar(0.02, 0) @ X_WK
    compared = Comparison(keyframe, second, DEPTH_NOISE, view_error=0.0)
    costs = motion_costs(compared, np.array([np.eye(4), motion]), LikelihoodParameters())
    v, u = keyframe.points.pixel
    tile = label[v, u] == 1
    # Where each point of the tile is then, and what is seen there: the tile, or the rim before it.
    z = first.depth[v, u]
    p_K = np.stack([(u - CAMERA.cx) / CAMERA.fx * z, (v - CAMERA.cy) / CAMERA.fy * z, z, np.ones(len(z))])
    uv = np.rint(project((compared.X_C1K @ motion @ p_K)[:3].T, CAMERA)).astype(int)
    behind = after[uv[:, 1], uv[:, 0]] == 2
    assert 100 < (behind & tile).sum() < tile.sum() / 2
    expected = np.bincount(keyframe.owner[behind & tile], minlength=keyframe.count) / np.maximum(
        keyframe.point_count, 1
    )
    of_tile = np.unique(keyframe.owner[tile])
    np.testing.assert_allclose(costs.covered[1, of_tile], expected[of_tile] * stood, atol=0.15)
    assert costs.covered[1, of_tile].sum() == pytest.approx(expected.sum() * stood, rel=0.03)


@pytest.mark.parametrize("another", [0.0, 0.3, 1.0])
def test_light_is_freer_the_farther_the_view_is_another_one(
    plate: tuple[Keyframe, Frame], another: float
) -> None:
    keyframe, frame = plate
    # A blank plate, brighter and otherwise the same: only how far it is said to be another view differs.
    brighter = replace(frame, color=np.full_like(frame.color, 132))
    compared = Comparison(keyframe, brighter, DEPTH_NOISE, view_error=0.0)
    vars(compared)["another_view"] = another
    misfit = motion_costs(compared, STILL, LikelihoodParameters(shadow=np.inf)).misfit[0]
    points = np.bincount(keyframe.owner, minlength=keyframe.count)
    c = 3 / (0.02**2 + (0.2 * another) ** 2)
    w = points[points > 0]
    f = (w * 120 * 132 / 8 + c) / (w * 120**2 / 8 + c)
    expected = (132 - 120 * f) ** 2 / 8 / f**2 + c * (f - 1) ** 2 / w + 1 - 3 / 14
    np.testing.assert_allclose(misfit[points > 0], np.minimum(expected, 9 + 1 - 3 / 14), rtol=0.02)


def test_light_is_freer_the_more_a_motion_tilts_and_no_freer_for_a_turn_on_the_table(
    plate: tuple[Keyframe, Frame], monkeypatch
) -> None:
    keyframe, frame = plate
    plane_W = np.array([0.6, 0.0, 0.8, -0.1])  # a table that slants
    keyframe = replace(keyframe, above=replace(keyframe.above, plane_W=plane_W))
    R_KW = keyframe.frame.X_WC[:3, :3].T
    up_K, along_K = R_KW @ plane_W[:3], R_KW @ np.array([0.0, 1.0, 0.0])
    asked = []

    def heard(compared, motion, factor, light, tilt, parameters):
        asked.append((light, tilt))
        return np.zeros((3, keyframe.count))

    monkeypatch.setattr(likelihood, "_misfit", heard)
    turns = [0.3 * up_K, 0.3 * along_K, 0.3 * along_K + 0.3 * up_K]
    motions = np.array([np.eye(4), *(exp_se3(np.append(turn, [0.01, 0.02, 0.0])) for turn in turns)])
    motion_costs(Comparison(keyframe, frame, DEPTH_NOISE, 0.0), motions, LikelihoodParameters())
    # Turned by an angle a about an axis at 45 degrees, n leans by b: cos b = 1/2 + cos(a) / 2.
    both = np.sin(np.arccos(0.5 + np.cos(0.3 * np.sqrt(2)) / 2))
    for (light, tilt), base, lean in zip(
        asked, [0.02, 0.05, 0.05, 0.05], [0, 0, np.sin(0.3), both], strict=True
    ):
        assert tilt == pytest.approx(lean, abs=1e-9)
        assert light == pytest.approx(np.hypot(base, 0.6 * lean))


def test_where_most_is_explained_by_nothing_yet_that_is_not_taken_for_noise():
    # Ten superpixels of 12 points each, two nats a squared residual, of which a motion explains three.
    misfit = np.full((2, 10), 9.0)
    misfit[1, :3] = 1.0
    costs = Costs(misfit, np.full(10, 12.0), *np.zeros((2, 2, 10)), np.zeros(10))
    parameters = LikelihoodParameters(chance=1.5, correlated_gray=3.0, superpixel_max=99.0)
    # What is usual is twice what is expected at most, 4, so that 6 may be by chance, and it disperses by 2.
    expected = np.zeros((2, 10))
    expected[0, :3] = (9 - 6) * 12 / (2 * 3 * 2)
    np.testing.assert_allclose(costs.nats(parameters), expected)


@pytest.mark.parametrize("tilt", [0.0, 0.6])
def test_how_far_a_motion_raises_a_point_is_the_change_of_its_height_above_the_table(
    plate: tuple[Keyframe, Frame], tilt: float
) -> None:
    keyframe, _ = plate
    rng = np.random.default_rng(2)
    plane_W = np.array([np.sin(tilt), 0, np.cos(tilt), -0.1])
    keyframe = replace(keyframe, above=replace(keyframe.above, plane_W=plane_W))
    motion = exp_se3(rng.normal(0, 0.3, 6))
    u, v, z = rng.uniform(0, 400, 20), rng.uniform(0, 300, 20), rng.uniform(0.3, 0.6, 20)
    k = keyframe.frame.intrinsics
    p_K = np.stack([(u - k.cx) / k.fx * z, (v - k.cy) / k.fy * z, z, np.ones(20)])
    height = plane_W @ keyframe.frame.X_WC @ np.stack([p_K, motion @ p_K])
    rises = z * (likelihood._rises(keyframe, motion) @ np.stack([u, v, np.ones(20), 1 / z]))
    np.testing.assert_allclose(rises, height[1] - height[0], atol=1e-6)
