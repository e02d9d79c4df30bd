"""A surface in another light is darker or brighter by one factor and keeps its pattern; depth is asked, too."""

import cv2
import numpy as np
import pytest

from riseg_drake.kernels.misfits import misfits

SIGMA = 3.0
PIECE = np.repeat([0, 1], 400)
CERTAINTY = 2400.0
"""6 / 0.05^2: a factor of 0.95 or 1.05 costs 6 squared residuals."""
NO_SHADOW = np.inf
"""Factors cost what shading says, however large."""
MOST, EXPECTED, PER_DEPTH = 9.0, 2.0, 0.25
NEARER = 0.01
"""m; what is so much in front of a point covers it."""
NO_DEPTH = np.zeros((21, 41), np.float32)
ONTO_ITSELF = np.eye(3, 4, dtype=np.float32)
LEVEL = np.zeros(4, np.float32)
"""Nothing rises or sinks."""
APART = (np.zeros((21, 41), np.int32), np.array([-1, -2], np.int32))
"""Nothing is known to be a whole: what is seen has the number 0, each piece another one."""
NOT_TILTED = (ONTO_ITSELF, False)
"""The way back of what has moved, by a motion that tilts nothing."""
UNKNOWN = (NO_DEPTH, ONTO_ITSELF, *NOT_TILTED, NO_DEPTH, *APART)
"""Depth of the other view, the ways back, and depth of the first; wholes."""


def pixels(count: int = 800) -> np.ndarray:
    """[4, count], row by row of an image of 40 columns, 0.5 m away."""
    v, u = np.divmod(np.arange(count), 40)
    return np.stack([u, v, np.ones(count), np.full(count, 2.0)]).astype(np.float32)


def image(values: np.ndarray) -> np.ndarray:
    """Values [800] at those pixels, and a row and a column beyond."""
    return np.pad(values.reshape(20, 40), ((0, 1), (0, 1)), mode="edge").astype(np.float32)


def pattern(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(60, 180, len(PIECE)).astype(np.float32)


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, SIGMA, len(PIECE)).astype(np.float32)


def costs(
    before: np.ndarray, after: np.ndarray, certainty: float = CERTAINTY, shadow: float = NO_SHADOW
) -> np.ndarray:
    """Of the gray values [2], where all pixels are seen again at their places."""
    per_variance = np.full(len(before), 1 / SIGMA**2, np.float32)
    total, lost, covered = misfits(
        pixels(), before, per_variance, PIECE, 2, ONTO_ITSELF, LEVEL, image(after), *UNKNOWN,
        0.003, 0.0, certainty, shadow, PER_DEPTH, MOST, EXPECTED, NEARER,
    )  # fmt: skip
    np.testing.assert_array_equal([lost, covered], 0)
    return total - np.bincount(PIECE)


def test_where_the_light_never_changes_the_cost_is_the_squared_residual() -> None:
    before, e = pattern(0), noise(1)
    of_noise = np.bincount(PIECE, np.minimum((e / SIGMA) ** 2, MOST))
    np.testing.assert_allclose(costs(before, before + e, certainty=1e12), of_noise, rtol=1e-4)


@pytest.mark.parametrize("light", [0.4, 0.8, 1.05])
def test_a_piece_in_another_light_costs_what_noise_does_and_once_the_price_of_that_light(light: float) -> None:
    before, e = pattern(0), noise(1)
    cost = costs(before, np.where(PIECE == 0, light, 1).astype(np.float32) * before + e)
    of_noise = np.bincount(PIECE, np.minimum((e / SIGMA) ** 2, MOST))
    price = CERTAINTY * (1 - light) ** 2
    assert cost[0] == pytest.approx(of_noise[0] / max(light, 1) ** 2 + price, rel=0.02)
    assert cost[1] == pytest.approx(of_noise[1], rel=0.02)


@pytest.mark.parametrize("light", [0.2, 0.5, 1.8])
def test_a_shadow_that_comes_or_goes_costs_the_same_however_dark_it_is(light: float) -> None:
    before, e = pattern(0), noise(1)
    cost = costs(before, np.where(PIECE == 0, light, 1).astype(np.float32) * before + e, shadow=50.0)
    of_noise = np.bincount(PIECE, np.minimum((e / SIGMA) ** 2, MOST))
    # CERTAINTY x 0.2^2 would be 96.
    assert cost[0] == pytest.approx(of_noise[0] / max(light, 1) ** 2 + 50, rel=0.02)
    assert cost[1] == pytest.approx(of_noise[1], rel=0.02)


def test_a_change_of_shading_that_is_likelier_than_a_shadow_costs_no_more_than_without_shadows() -> None:
    before, e = pattern(0), noise(1)
    after = np.float32(0.9) * before + e
    np.testing.assert_array_equal(costs(before, after, shadow=50.0), costs(before, after))


def test_the_factor_is_the_likeliest_one() -> None:
    # One pixel that went from 100 to 90: (90 - 100 f)^2 + c (f - 1)^2 is least at f = (9000 + c) / (10000 + c).
    before, ones = np.full(800, 100, np.float32), np.ones(800, np.float32)
    after = before.copy()
    after[0] = 90
    total, _, _ = misfits(
        pixels(), before, ones, np.arange(800), 800, ONTO_ITSELF, LEVEL, image(after), *UNKNOWN[:6],
        -1 - np.arange(800, dtype=np.int32), 0.003, 0.0, 1e4, NO_SHADOW, PER_DEPTH, 1e4, EXPECTED, NEARER,
    )  # fmt: skip
    assert total[0] - 1 == pytest.approx((90 - 95) ** 2 + 1e4 * 0.05**2)
    np.testing.assert_array_equal(total[1:], 1)


def test_another_pattern_is_explained_by_no_light() -> None:
    assert costs(pattern(0), pattern(2)).sum() / len(PIECE) > 6


def test_what_was_not_found_counts_as_expected_and_says_nothing_about_the_rest() -> None:
    before = pattern(0)
    after = image(0.5 * before + noise(1))
    after[5:8] = np.nan  # rows 4 to 7 cannot be read between pixels
    total, lost, covered = misfits(
        pixels(), before, np.full(800, 1 / SIGMA**2, np.float32), PIECE, 2, ONTO_ITSELF, LEVEL, after, *UNKNOWN,
        0.003, 0.0, CERTAINTY, NO_SHADOW, PER_DEPTH, MOST, EXPECTED, NEARER,
    )  # fmt: skip
    np.testing.assert_array_equal([lost, covered], [[160, 0], [0, 0]])
    assert total[0] == pytest.approx(160 * EXPECTED + 240 * 2 + CERTAINTY * 0.25, rel=0.1)


@pytest.mark.parametrize(
    ("nearer", "error"), [(0.0, 0.0), (0.001, 0.0), (0.001, 0.01), (-0.1, 0.0), (0.009, 0.0), (0.02, 0.02)]
)
def test_depth_costs_its_squared_residual_less_what_is_right(nearer: float, error: float) -> None:
    """Also where it is much farther, and where it is nearer by less than a centimetre or three deviations."""
    before = pattern(0)
    depth = np.full((21, 41), 0.5 - nearer, np.float32)
    total, _, _ = misfits(
        pixels(), before, np.ones(800, np.float32), PIECE, 2, ONTO_ITSELF, LEVEL, image(before), depth,
        ONTO_ITSELF, *NOT_TILTED, depth, *APART,
        0.004, error, CERTAINTY, NO_SHADOW, PER_DEPTH, MOST, EXPECTED, NEARER,
    )  # fmt: skip
    squared = nearer**2 / ((0.004 * 0.25) ** 2 + (error * 0.5) ** 2)
    np.testing.assert_allclose(total / 400, 1 + PER_DEPTH * (min(squared, MOST) - 1), rtol=1e-3)


def test_a_point_that_sinks_by_half_of_that_is_not_covered_but_wrong() -> None:
    """A row of 40 sinks the more the farther right: by 5 mm from its 31st pixel on."""
    before, depth = pattern(0), np.full((21, 41), 0.45, np.float32)
    # At 0.5 m, metres are half of the product with (u, v, 1, 2).
    sinks = np.array([-0.001, 0, 0, 0.5 * 0.0201], np.float32)
    _, _, covered = misfits(
        pixels(), before, np.ones(800, np.float32), PIECE, 2, ONTO_ITSELF, sinks, image(before), depth,
        ONTO_ITSELF, *NOT_TILTED, depth, *APART,
        0.003, 0.0, CERTAINTY, NO_SHADOW, PER_DEPTH, MOST, EXPECTED, NEARER,
    )  # fmt: skip
    # (-0.001 u + 0.0201) / 2 < -0.005 from u = 31 on: nine of 40 columns, in ten rows of each piece.
    np.testing.assert_array_equal(covered, [400 - 90, 400 - 90])


@pytest.mark.parametrize("nearer", [0.011, 0.1])
def test_a_point_behind_something_is_covered_and_counts_as_expected_whatever_is_seen_there(
    nearer: float,
) -> None:
    """Of the first piece three rows of 40, whose gray is another one."""
    before, depth = pattern(0), np.full((21, 41), 0.5, np.float32)
    depth[:3] -= nearer
    total, lost, covered = misfits(
        pixels(), before, np.ones(800, np.float32), PIECE, 2, ONTO_ITSELF, LEVEL,
        image(np.where(np.arange(800) < 120, 0, before)), depth,
        ONTO_ITSELF, *NOT_TILTED, depth, *APART,
        0.003, 0.0, CERTAINTY, NO_SHADOW, PER_DEPTH, MOST, EXPECTED, NEARER,
    )  # fmt: skip
    np.testing.assert_array_equal([lost, covered], [[0, 0], [120, 0]])
    right = 1 - PER_DEPTH
    np.testing.assert_allclose(total, [120 * EXPECTED + 280 * right, 400 * right], rtol=1e-6)


@pytest.mark.parametrize(
    ("before", "stood"), [(0.45, True), (0.455, True), (0.439, False), (0.5, False), (0, False)]
)
def test_what_came_there_since_covers_nothing(before: float, stood: bool) -> None:
    values, depth_0 = pattern(0), np.full((21, 41), before, np.float32)
    depth = np.full((21, 41), 0.45, np.float32)
    _, _, covered = misfits(
        pixels(), values, np.ones(800, np.float32), PIECE, 2, ONTO_ITSELF, LEVEL, image(values), depth,
        ONTO_ITSELF, *NOT_TILTED, depth_0, *APART,
        0.003, 0.0, CERTAINTY, NO_SHADOW, PER_DEPTH, MOST, EXPECTED, NEARER,
    )  # fmt: skip
    np.testing.assert_array_equal(covered, [400 * stood, 400 * stood])


def test_a_thing_that_is_known_to_be_one_does_not_hide_itself() -> None:
    """Eleven columns to the left of where it is looked up stood piece 0's own whole, elsewhere another one."""
    values, depth = pattern(0), np.full((21, 41), 0.45, np.float32)
    whole_0 = np.full((21, 41), 6, np.int32)
    whole_0[:, :11] = 5
    total, _, covered = misfits(
        pixels(), values, np.ones(800, np.float32), PIECE, 2, ONTO_ITSELF, LEVEL, image(values), depth,
        ONTO_ITSELF, *NOT_TILTED, depth, whole_0, np.array([5, 7], np.int32),
        0.003, 0.0, CERTAINTY, NO_SHADOW, PER_DEPTH, MOST, EXPECTED, NEARER,
    )  # fmt: skip
    np.testing.assert_array_equal(covered, [400 - 110, 400])
    # What is not covered is 5 cm off: as bad as can be.
    wrong = 1 + PER_DEPTH * (MOST - 1)
    np.testing.assert_allclose(total, [290 * EXPECTED + 110 * wrong, 400 * EXPECTED], rtol=1e-6)


@pytest.mark.parametrize("tilts", [True, False])
@pytest.mark.parametrize(
    ("came_from", "numbers"),
    [
        (-9, (-1, -2)),  # nothing is known of either
        (7, (7, 8)),  # it came from what is known to be the first piece's own whole
        (0, (-1, -2)),  # from the table
    ],
)
def test_what_a_body_turns_away_from_view_is_hidden_by_that_body(came_from, numbers, tilts):
    """All points are 5 cm behind what is seen; that was 5 columns farther right, 2 mm nearer than it is now,
    and on the right, from column 30 on, 8 mm. Nothing stood where it stands now."""
    values, depth = pattern(0), np.full((21, 41), 0.45, np.float32)
    undone = np.array([[1, 0, 5, 0], [0, 1, 0, 0], [0, 0, 1, 0]], np.float32)
    depth_0 = np.full((21, 41), 0.448, np.float32)
    depth_0[:, 30:] = 0.442
    farther = np.eye(3, 4, dtype=np.float32)
    farther[2, 3] = 1.0  # back without having moved, nothing is where it was
    whole_0 = np.full((21, 41), came_from, np.int32)
    _, _, covered = misfits(
        pixels(), values, np.ones(800, np.float32), PIECE, 2, ONTO_ITSELF, LEVEL, image(values), depth,
        farther, undone, tilts, depth_0, whole_0, np.array(numbers, np.int32),
        0.003, 0.0, CERTAINTY, NO_SHADOW, PER_DEPTH, MOST, EXPECTED, NEARER,
    )  # fmt: skip
    of_one = [came_from == n or (came_from < 0 and n < 0) for n in numbers]
    # Within half of a centimetre: columns 0 to 24 of 40, in ten rows of each piece.
    np.testing.assert_array_equal(covered, [250 * tilts * one for one in of_one])


def test_under_any_motion_it_is_what_numpy_and_opencv_find() -> None:
    rng = np.random.default_rng(3)
    gray_1 = cv2.GaussianBlur(rng.uniform(0, 255, (60, 80)).astype(np.float32), (0, 0), 3) * 3
    depth_1 = rng.uniform(0.49, 0.51, (60, 80)).astype(np.float32)
    gray_1[20:30, 40:50] = np.nan
    depth_1[:, :10] = 0
    depth_1[40:50, 20:60] -= 0.1
    u, v = rng.uniform(0, 79, 900), rng.uniform(0, 59, 900)
    pixel = np.stack([u, v, np.ones(900), 1 / rng.uniform(0.49, 0.51, 900)]).astype(np.float32)
    gray, owner = rng.uniform(100, 160, 900).astype(np.float32), np.sort(rng.integers(0, 12, 900))
    per_variance = rng.uniform(0.01, 0.1, 900).astype(np.float32)
    # What is seen at (u, v) was at (u + 5, v - 3); on the right something else stood there.
    back = np.array([[1, 0, 5, 0], [0, 1, -3, 0], [0, 0, 1, 0]], np.float32)
    depth_0 = np.where(np.arange(80) < 50, 0.4, 0.2) * np.ones((60, 1))
    M = np.array([[1.02, 0.03, -2, 1.2], [-0.02, 0.98, 3, -0.8], [1e-4, -1e-4, 1, 0.004]], np.float32)
    total, lost, covered = misfits(
        pixel, gray, per_variance, owner, 12, M, LEVEL, gray_1, depth_1, back, *NOT_TILTED,
        depth_0.astype(np.float32),
        np.zeros((60, 80), np.int32), -1 - np.arange(12, dtype=np.int32),
        0.003, 0.002, CERTAINTY, NO_SHADOW, PER_DEPTH, MOST, EXPECTED, 0.05,
    )  # fmt: skip

    a, b, c = M @ pixel
    u_1, v_1 = (a / c)[None], (b / c)[None]
    after = cv2.remap(gray_1, u_1, v_1, cv2.INTER_LINEAR, borderMode=0, borderValue=np.nan)[0]
    u_n, v_n = np.rint(u_1[0]).astype(int), np.rint(v_1[0]).astype(int)
    inside = (u_n >= 0) & (u_n < 80) & (v_n >= 0) & (v_n < 60)
    z_1 = np.where(inside, depth_1[v_n.clip(0, 59), u_n.clip(0, 79)], 0)
    z = c / pixel[3]
    behind = np.isfinite(after) & (z_1 > 0) & (z_1 < z - 0.05) & (u_n + 5 < 50)
    assert 20 < behind.sum() < 80
    known = np.isfinite(after) & ~behind
    # OpenCV reads at 1/32 of a pixel.
    np.testing.assert_allclose(lost, np.bincount(owner, ~np.isfinite(after)), atol=1)
    np.testing.assert_allclose(covered, np.bincount(owner, behind, 12), atol=1)
    expected = np.zeros(12)
    for p in range(12):
        mine = known & (owner == p)
        w, x, y = per_variance[mine], gray[mine], after[mine]
        of_gray = np.minimum(w * (y - x) ** 2, MOST).sum()
        if of_gray > 0.5 * mine.sum():
            f = (np.sum(w * x * y) + CERTAINTY) / (np.sum(w * x * x) + CERTAINTY)
            other = np.minimum(w * (y - f * x) ** 2 / max(f, 1) ** 2, MOST).sum() + CERTAINTY * (f - 1) ** 2
            of_gray = min(of_gray, other)
        squared = (z_1 - z) ** 2 / ((0.003 * z**2) ** 2 + (0.002 * z) ** 2)
        of_depth = PER_DEPTH * (np.minimum(squared, MOST) - 1)[mine & (z_1 > 0)].sum()
        expected[p] = of_gray + of_depth + mine.sum() + EXPECTED * np.sum(~known & (owner == p))
    np.testing.assert_allclose(total, expected, rtol=0.02)
