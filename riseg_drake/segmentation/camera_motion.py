"""How far the poses can be trusted, and what the images say where they cannot (not in the paper).

The paper takes the camera's motion from the arm's joints and believes it. Poses from elsewhere err: by a
millimetre and a tenth of a degree, what stands still seems to move by two pixels, and would be an object.
The table tells: seen from two poses it must be the same plane. By how much it is not, over the last
frames, is what the poses are worth. Where that is more than a fraction of a pixel, the motion between two
frames is set right by what does not move, as far as poses may err, and what then still differs between
expected and observed flow is the noise above which something moves.

A table tells less than it seems to where depth errs smoothly and differently from each view: it tilts by a
degree between two frames of a camera that stands still. So the images have the last word: where they leave a
fraction of a pixel between expected and observed flow, in this pair or whenever nothing moves, the poses are
exact, and a correction that leaves more than there was before is none. Else things that move on a blank table
would be what stands still.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from riseg_drake.geometry.camera import pixel_grid, project, rays, rays_at
from riseg_drake.geometry.plane import transform_plane
from riseg_drake.geometry.rgbd import Frame, FramePair, Immutable
from riseg_drake.geometry.se3 import exp_se3, inverse, move_points, skew
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.noise import MeasurementNoise, flow_sigma
from riseg_drake.segmentation.scales import OUTLIER

_PLANE_TILT_SIGMA, _PLANE_HEIGHT_SIGMA = 5e-4, 3e-4
"""Standard deviations of a fitted table's tilt, rad, and height, m."""
_BOUNDARY = np.ones((15, 15), np.uint8)
"""So far from an outline, in pixels, flow of one side leaks to the other."""
_CORRELATED = 9.0
"""Points of flow that are worth one."""
_STILL_TABLE, _STILL_ALL = 0.75, 0.5
"""Shares of the points of the table, and of all points, that surely stand still. What is left between expected
and observed flow has long tails, since depth errs; its standard deviation is read off as far out as what moves
may allow."""
_AT_REST, _FEWEST = 0.25, 4
"""Of the last frames in at least this share nothing moves; and so many it takes to say what they leave then."""
_FIT_ROUNDS, _HYPOTHESES, _VOTERS = 5, 128, 500


@dataclass
class CameraMotionParameters:
    """When poses are set right, and how far."""

    exact: float = 0.5
    """Pixels of the whole frame; poses whose error moves the image by less are taken as they are."""
    frames: float = 30.0
    """Over about so many frames that the camera moved is the poses' error estimated."""
    confidence: float = 0.95
    """The error is the upper end of what the table shows with that confidence."""
    reach: float = 4.0
    """Standard deviations of the poses' error by which the motion may be set right at most."""
    tilt_max: float = 0.09
    """rad; where the table tilts by more between two frames, it is another plane."""
    height_max: float = 0.03
    """m; where it rises or sinks by more, too."""
    points: int = 2000
    """Of the pixels that have texture, and no outline near by, so many are asked at most."""


@dataclass(frozen=True)
class PoseError(Immutable):
    """What the table showed of the poses' error so far; of the motion between two frames."""

    tilt_squares: float = 0.0
    """Sum of squared tilts of the table between consecutive frames, rad^2; two for each frame."""
    height_squares: float = 0.0
    """Sum of squared changes of its height, m^2."""
    frames: float = 0.0
    """How many frames that is; old ones count less and less."""
    left: tuple[float, ...] = ()
    """What the images left of the last motions by the poses as they came, pixels of the whole frame."""

    @property
    def by_images(self) -> float:
        """Pixels of the whole frame by which what stands still seems to move; inf where too little is known."""
        return float(np.quantile(self.left, _AT_REST)) if len(self.left) >= _FEWEST else np.inf

    def sigma(self, confidence: float) -> tuple[float, float]:
        """Upper ends of the standard deviations of rotation, rad, and translation, m, of each axis."""
        if self.frames < 1:
            return 0.0, 0.0
        return (
            float(np.sqrt(self.tilt_squares / chi2.ppf(1 - confidence, 2 * self.frames))),
            float(np.sqrt(self.height_squares / chi2.ppf(1 - confidence, self.frames))),
        )


def table_change(
    before: Frame, plane_W0: NDArray, after: Frame, plane_W1: NDArray
) -> tuple[NDArray[np.float64], float, NDArray[np.float64], NDArray[np.float64]]:
    """How the table of one frame differs from where the frame before has it.

    Returns:
        tilt [3], rad, a rotation in C1 from where it should be to where it is; height, m, of the expected
        table above the found one amid the view; that point p_C1T [3]; the found plane_C1 [4].
    """
    X_C1W = inverse(after.X_WC)
    expected, found = transform_plane(X_C1W, plane_W0), transform_plane(X_C1W, plane_W1)
    k = after.intrinsics
    ray = rays_at(np.array([k.width / 2, k.height / 2]), k)
    p_C1T = ray * (-expected[3] / min(float(expected[:3] @ ray), -1e-3))
    return np.cross(expected[:3], found[:3]), float(found[:3] @ p_C1T + found[3]), p_C1T, found


def renewed_pose_error(
    known: PoseError,
    before: Frame,
    above_0: AboveTable,
    after: Frame,
    above_1: AboveTable,
    parameters: CameraMotionParameters,
    left: float = 0.0,
) -> PoseError:
    """The poses' error in the light of one more frame, and of what the images have `left` of the motion before
    it, pixels of the whole frame; 0: nothing was asked."""
    if left > 0:
        known = replace(known, left=(*known.left, left)[-round(parameters.frames) :])
    if np.array_equal(before.X_WC, after.X_WC):
        return known  # a camera that stands still says nothing about how it moves
    tilt, height, _, _ = table_change(before, above_0.plane_W, after, above_1.plane_W)
    if np.linalg.norm(tilt) > parameters.tilt_max or abs(height) > parameters.height_max:
        return known
    # Poses that err do so in every frame; a table of which little was seen may tilt once.
    most_R, most_p = OUTLIER * np.square(known.sigma(parameters.confidence))
    if known.frames == 0:
        most_R = most_p = np.inf
    kept = max(0.0, 1 - 1 / parameters.frames)
    return replace(
        known,
        tilt_squares=kept * known.tilt_squares + min(float(tilt @ tilt), 2 * most_R),
        height_squares=kept * known.height_squares + min(height**2, most_p),
        frames=kept * known.frames + 1,
    )


def settled_pair(
    pair: FramePair,
    optical_flow: NDArray[np.float32],
    above_0: AboveTable,
    above_1: AboveTable,
    error: PoseError,
    noise: MeasurementNoise,
    parameters: CameraMotionParameters,
) -> FramePair:
    """The pair with the camera's motion set right where its poses are not exact; else the pair itself.

    Args:
        pair: the frames of t-1 and t.
        optical_flow: O_t [H, W, 2], pixels.
        above_0: the table and what stands on it, at t-1 and
        above_1: at t.
        error: of the poses, as far as it is known.
        noise: of the images.
        parameters: see there.
    """
    intrinsics = pair.current.intrinsics
    sigma_R, sigma_p = error.sigma(parameters.confidence)
    if pair.current.whole.intrinsics.fx * np.hypot(sigma_R, sigma_p / above_0.distance) < parameters.exact:
        return pair
    p_C0Q, residual_sigma, on_table, uv_1 = _points(pair, optical_flow, above_0, noise, parameters.points)
    if len(p_C0Q) < 30:
        return pair
    # The error of both poses enters, as it does between consecutive frames.
    change = table_change(pair.reference, above_0.plane_W, pair.current, above_1.plane_W)
    same_plane = np.linalg.norm(change[0]) < parameters.tilt_max and abs(change[1]) < parameters.height_max
    enough_table = np.count_nonzero(on_table) >= 200
    judges = on_table if enough_table else np.ones(len(p_C0Q), bool)
    still = _STILL_TABLE if enough_table else _STILL_ALL

    def residual(X_C1C0: NDArray) -> float:
        apart = uv_1[judges] - project(move_points(X_C1C0, p_C0Q[judges]), intrinsics)
        return float(np.quantile(np.abs(apart), still) / norm.ppf(0.5 + still / 2))

    given = residual(pair.X_C1C0)
    reduction = pair.current.reduction
    pair = replace(pair, given_residual=given * reduction)
    at_rest = min(pair.given_residual, error.by_images)
    if at_rest < parameters.exact:
        return replace(pair, residual=at_rest / reduction, pose_error=at_rest)
    tried = [pair.X_C1C0]
    for believed in (change, None) if same_plane else (None,):
        V = _fit(p_C0Q, uv_1, residual_sigma, pair, believed, (sigma_R, sigma_p), parameters)
        tried.append(exp_se3(V) @ pair.X_C1C0)
    left = [given, *map(residual, tried[1:])]
    best = int(np.argmin(left))
    current = pair.current
    if best > 0:
        current = replace(current, X_WC=pair.reference.X_WC @ inverse(tried[best]))
    return replace(pair, current=current, residual=left[best])


def _points(
    pair: FramePair,
    optical_flow: NDArray[np.float32],
    above_0: AboveTable,
    noise: MeasurementNoise,
    most: int,
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Textured points p_C0Q [N, 3], the noise of their flow [N], whether they are table, and (u, v) at t."""
    reference, intrinsics = pair.reference, pair.current.intrinsics
    sigma = flow_sigma(reference.gray, noise)
    uv_1 = pixel_grid(*intrinsics.shape) + optical_flow
    inside = (uv_1 >= 0).all(-1) & (uv_1[..., 0] < intrinsics.width) & (uv_1[..., 1] < intrinsics.height)
    boundary = cv2.morphologyEx(above_0.mask.astype(np.uint8), cv2.MORPH_GRADIENT, _BOUNDARY) > 0
    good = ~boundary & inside & (reference.depth > 0) & ~reference.robot & (sigma < 2 * noise.flow)
    v, u = np.nonzero(good)
    every = slice(None, None, max(1, -(-len(v) // most)))
    asked = v[every], u[every]
    p_C0Q = (rays(intrinsics)[asked] * reference.depth[asked][:, None]).astype(float)
    return p_C0Q, sigma[asked].astype(float), ~above_0.mask[asked], uv_1[asked].astype(float)


def _fit(
    p_C0Q: NDArray,
    uv_1: NDArray,
    flow_noise: NDArray,
    pair: FramePair,
    change: tuple[NDArray, float, NDArray, NDArray] | None,
    sigma: tuple[float, float],
    parameters: CameraMotionParameters,
) -> NDArray[np.float64]:
    """The small motion [6] of C1 by which most points, and the table if believed, agree with the images."""
    sigma_V = np.repeat(np.maximum(sigma, (1e-5, 1e-5)), 3)
    normal_0 = np.diag(sigma_V**-2.0)
    rhs_0 = np.zeros(6)
    if change is not None:
        tilt, height, p_C1T, plane_C1 = change
        n = plane_C1[:3]
        across = np.hstack([np.eye(3) - np.outer(n, n), np.zeros((3, 3))]) / _PLANE_TILT_SIGMA
        along = np.hstack([np.cross(p_C1T, n), n]) / _PLANE_HEIGHT_SIGMA
        normal_0 += across.T @ across + np.outer(along, along)
        rhs_0 += across.T @ (tilt / _PLANE_TILT_SIGMA) - along * (height / _PLANE_HEIGHT_SIGMA)
    V = _consensus(*_linearised(np.zeros(6), p_C0Q, uv_1, pair), flow_noise, normal_0, rhs_0)
    for _ in range(_FIT_ROUNDS):
        apart, J = _linearised(V, p_C0Q, uv_1, pair)
        squared = (apart**2).sum(1)
        weight = 1 / (1 + squared / (3 * flow_noise) ** 2) ** 2 / (_CORRELATED * flow_noise**2)
        JW = J * weight[:, None, None]
        normal = np.einsum("nki,nkj->ij", JW, J) + normal_0
        rhs = np.einsum("nki,nk->i", JW, apart + np.einsum("nki,i->nk", J, V)) + rhs_0
        V = np.linalg.solve(normal, rhs)
    return V / max(1.0, float(np.abs(V / (parameters.reach * sigma_V)).max()))


def _consensus(
    apart: NDArray, J: NDArray, flow_noise: NDArray, normal_0: NDArray, rhs_0: NDArray
) -> NDArray[np.float64]:
    """Of the motions [6] that a few random points each give, the one that the most points agree with.

    What moves alike may be a large part of all that has texture: no average tells it from the rest.
    """
    rng = np.random.default_rng(0)
    few = rng.integers(len(apart), size=(_HYPOTHESES, 4))
    J_few = J[few].reshape(_HYPOTHESES, 8, 6) / flow_noise[few].repeat(2, axis=1)[..., None]
    apart_few = apart[few].reshape(_HYPOTHESES, 8) / flow_noise[few].repeat(2, axis=1)
    normal = J_few.swapaxes(1, 2) @ J_few + normal_0
    rhs = np.einsum("hki,hk->hi", J_few, apart_few) + rhs_0
    V = np.linalg.solve(normal, rhs[..., None])[..., 0]
    asked = rng.integers(len(apart), size=_VOTERS)
    left = apart[asked] - np.einsum("nki,hi->hnk", J[asked], V)
    cost = np.minimum((left**2).sum(-1) / (3 * flow_noise[asked]) ** 2, 1.0).sum(1)
    unlikely = np.einsum("hi,ij,hj->h", V, normal_0, V) - 2 * V @ rhs_0
    return V[np.argmin(cost * (len(apart) / _CORRELATED / _VOTERS) + 0.5 * unlikely)]


def _linearised(
    V: NDArray, p_C0Q: NDArray, uv_1: NDArray, pair: FramePair
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """By how many pixels [N, 2] points appear elsewhere than C1 moved by V has them, and how V changes that."""
    k = pair.current.intrinsics
    p = move_points(exp_se3(V) @ pair.X_C1C0, p_C0Q)
    per_z = 1 / np.maximum(p[:, 2], 1e-3)
    d_uv = np.zeros((len(p), 2, 3))
    d_uv[:, 0, 0], d_uv[:, 0, 2] = k.fx * per_z, -k.fx * p[:, 0] * per_z**2
    d_uv[:, 1, 1], d_uv[:, 1, 2] = k.fy * per_z, -k.fy * p[:, 1] * per_z**2
    apart = uv_1 - project(p, k)
    lost = ~np.isfinite(apart).all(1)
    apart[lost], d_uv[lost] = 1e3, 0  # behind the camera: as wrong as can be
    return apart, np.concatenate([d_uv @ -skew(p), d_uv], axis=-1)
