"""How badly a rigid motion explains each superpixel, `segmentation.likelihood`."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.kernels.compiled import compiled
from riseg_drake.kernels.reading import Real, between, nearest, placed, projected


@compiled()
def _sinks(rises: NDArray[np.float32], pixel: NDArray[np.float32], n: int, depth: float) -> bool:
    """Whether point n of `pixel` sinks by more than `depth`, m."""
    rise = rises[0] * pixel[0, n] + rises[1] * pixel[1, n] + rises[2] + rises[3] * pixel[3, n]
    return bool(rise < -depth * pixel[3, n])


@compiled()
def _seen_before(
    back: NDArray[np.float32],
    u: Real,
    v: Real,
    z: Real,
    depth_0: NDArray[np.float32],
    near: Real,
    whole_0: NDArray[np.int32],
    whole: int,
    same: bool,
) -> bool:
    """Whether what is seen at (u, v) and depth z, m, was seen where it was before, within `near`, and is of
    another `whole`, or where that is asked of the `same` one, as far as is known."""
    u, v, c = placed(back, np.floor(u + np.float32(0.5)), np.floor(v + np.float32(0.5)), 1 / z)
    apart, number = nearest(depth_0, u, v) - c * z, nearest(whole_0, u, v)
    fits = (number == whole or (number < 0 and whole < 0)) if same else number != whole
    return bool(fits and -near < apart < near)


@compiled(
    "UniTuple(float64[::1], 3)(float32[:, ::1], float32[::1], float32[::1], intp[::1], intp, float32[:, ::1],"
    "float32[::1], float32[:, ::1], float32[:, ::1], float32[:, ::1], float32[:, ::1], boolean,"
    "float32[:, ::1], int32[:, ::1], int32[::1], float64, float64, float64, float64, float64, float64, float64,"
    "float64)"
)
def misfits(
    pixel: NDArray[np.float32],
    gray: NDArray[np.float32],
    per_variance: NDArray[np.float32],
    owner: NDArray[np.intp],
    count: int,
    M: NDArray[np.float32],
    rises: NDArray[np.float32],
    gray_1: NDArray[np.float32],
    depth_1: NDArray[np.float32],
    back: NDArray[np.float32],
    undone: NDArray[np.float32],
    tilts: bool,
    depth_0: NDArray[np.float32],
    whole_0: NDArray[np.int32],
    whole: NDArray[np.int32],
    depth_noise: float,
    depth_error: float,
    certainty: float,
    shadow: float,
    per_depth: float,
    most: float,
    expected: float,
    nearer: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Summed squared residuals of the points of N superpixels, how many cannot be compared, and of how many
    something nearer is seen, all [N].

    What turns is shaded anew, and shadows come and go: a surface becomes darker by one factor and keeps its
    pattern. So the gray values of each superpixel may have changed by a factor, where that is likelier.

    Args:
        pixel: [4, W or more], (u, v, 1, 1 / z) of W points.
        gray: [W], their gray values.
        per_variance: [W], 1 / variance of the difference between that and where it should reappear.
        owner: [W], 0..N-1, the superpixel of each.
        count: N.
        M: [3, 4], see `pixel_projection`.
        rises: [4], metres by which a point rises from the table, divided by its depth z, are its product with
            (u, v, 1, 1 / z).
        gray_1: [H, W], of the other view; NaN where there is nothing to compare.
        depth_1: [H, W], m; 0 where there is none.
        back: [3, 4], as M, from the other view to this, for what stands still.
        undone: [3, 4], the same for what has moved.
        tilts: whether it has turned about more than the table's normal.
        depth_0: [H, W], of this view, m.
        whole_0: [H, W], of this view: which number each known whole has, whose parts do not hide each other.
        whole: [N], of each superpixel.
        depth_noise: of the difference of two depths at 1 m, m.
        depth_error: share of depth by which it errs besides.
        certainty: 1 / variance of the factor, in the measure of a superpixel's squared residuals.
        shadow: what any factor costs at most, in the same measure.
        per_depth: what a squared residual of depth counts beside one of gray.
        most: squared residuals count no more than that: beyond, they are no noise.
        expected: what a point counts that cannot be compared, or is covered.
        nearer: m; what is seen by more than that in front of a point, and by more than noise, covers it, if it
            stood there before and is another thing, and the point has not sunk by half of that: into the table,
            behind itself.
    """
    total, known, lost, covered = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    before_after, before_before, of_gray = np.zeros(count), np.zeros(count), np.zeros(count)
    after = np.empty(len(gray), np.float32)
    for n in range(len(gray)):
        p = owner[n]
        u, v, c = projected(M, pixel, n)
        after[n] = between(gray_1, u, v)
        if np.isnan(after[n]):
            lost[p] += 1
            total[p] += expected
            continue
        z, z_1 = c / pixel[3, n], nearest(depth_1, u, v)
        variance = (depth_noise * z * z) ** 2 + (depth_error * z) ** 2
        in_front = 0 < z_1 < z - nearer and (z_1 - z) ** 2 > most * variance
        # A body that turns hides what it showed; what stood before a place hides what goes there.
        if in_front and (
            (tilts and _seen_before(undone, u, v, z_1, depth_0, nearer / 2, whole_0, whole[p], True))
            or (
                _seen_before(back, u, v, z_1, depth_0, nearer, whole_0, whole[p], False)
                and not _sinks(rises, pixel, n, nearer / 2)
            )
        ):
            after[n] = np.nan
            covered[p] += 1
            total[p] += expected
            continue
        known[p] += 1
        weighted = per_variance[n] * gray[n]
        before_after[p] += weighted * after[n]
        before_before[p] += weighted * gray[n]
        of_gray[p] += min(per_variance[n] * (after[n] - gray[n]) ** 2, most)
        total[p] += 1
        if z_1 > 0:
            # Against what is right: depth that is not there says neither.
            total[p] += per_depth * (min((z_1 - z) ** 2 / variance, most) - 1)
    # The likeliest factor, by least squares, where the light seems to have changed; it costs once.
    factor, of_factor = np.ones(count), np.full(count, np.inf)
    for p in range(count):
        if of_gray[p] > 0.5 * known[p] and before_before[p] > 0:
            factor[p] = before_after[p] / before_before[p]
            of_factor[p] = shadow
            if certainty * (factor[p] - 1) ** 2 < shadow:
                factor[p] = (before_after[p] + certainty) / (before_before[p] + certainty)
                of_factor[p] = certainty * (factor[p] - 1) ** 2
    for n in range(len(gray)):
        p = owner[n]
        if of_factor[p] < np.inf and not np.isnan(after[n]):
            # With it the noise of the first image is amplified.
            noise = max(factor[p], 1.0) ** 2
            of_factor[p] += min(per_variance[n] * (after[n] - factor[p] * gray[n]) ** 2 / noise, most)
    for p in range(count):
        total[p] += min(of_gray[p], of_factor[p])
    return total, lost, covered
