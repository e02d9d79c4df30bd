"""Where the camera is, on the wrist or in the world, from views of a board: all pixels at once, and how sure.

A first guess comes from what each view says alone (OpenCV's solvePnP) and the equation A X = X B of hand-eye
calibration, by rotation vectors (Park and Martin 1994); the rest is least squares over all corners. OpenCV's
own calibrateHandEye is not asked: the bindings of OpenCV 5 do not have it any more.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics, project
from riseg_drake.geometry.se3 import exp_se3, inverse, move_points

FEWEST_VIEWS = 4
"""Three leave nothing by which errors are seen."""
LEAST_TURN = 0.1
"""rad; views turned about two axes by less than this tell nothing of where the camera is."""
_BAD = (3.0, 1.0)
"""A view is left out whose corners are this many times as far off as in others, and this many pixels."""


class CalibrationError(ValueError):
    """Views from which the camera's place does not follow; says in one line what would be right."""


@dataclass(frozen=True)
class BoardView:
    """One picture of the board."""

    name: str
    X_WE: NDArray[np.float64]
    """The tip's pose, [4, 4]."""
    p_BQ: NDArray[np.float64]
    """[N, 3], m, corners on the board."""
    uv: NDArray[np.float64]
    """[N, 2], pixels of a pinhole."""


@dataclass(frozen=True)
class CameraCalibration:
    """What came of it."""

    X: NDArray[np.float64]
    """X_EC of a camera on the wrist, X_WC of one in the world, [4, 4]."""
    Y: NDArray[np.float64]
    """X_WB of the board that lies, X_EB of one that is carried, [4, 4]."""
    residual: float
    """Pixels from corners to where they should be, root mean square of each coordinate."""
    translation_error: float
    """Standard error of where the camera is, m, if nothing errs but the corners' pixels."""
    rotation_error: float
    """The same of how it is turned, rad."""
    left_out: tuple[str, ...]
    """Names of views that do not fit the others."""


def calibrated(views: Sequence[BoardView], k: Intrinsics, *, world: bool = False) -> CameraCalibration:
    """The camera's pose on the tip, from views of a board that lies; with `world`, that of a camera which
    stands in the world, from views of a board that the tip carries.

    Raises CalibrationError for views that are too few or too much alike.
    """
    if len(views) < FEWEST_VIEWS:
        raise CalibrationError(
            f"the board is seen in {len(views)} views; at least {FEWEST_VIEWS} are wanted, better a dozen"
        )
    X, Y = _first_guess(views, k, world)
    X, Y, _ = _refined(views, k, X, Y, world)
    errors = [float(np.sqrt(np.mean(_residuals([view], k, X, Y, world) ** 2))) for view in views]
    good = [error <= max(_BAD[0] * float(np.median(errors)), _BAD[1]) for error in errors]
    kept = [view for view, fits in zip(views, good, strict=True) if fits]
    if len(kept) < FEWEST_VIEWS:
        raise CalibrationError(
            f"only {len(kept)} of {len(views)} views fit each other: are the board's size and the arm's poses "
            "those of the pictures, and did the board stay where it was?"
        )
    X, Y, _ = _refined(kept, k, X, Y, world)
    X, Y, J = _refined(kept, k, X, Y, world)  # once more, for the derivatives where it ends
    residuals = _residuals(kept, k, X, Y, world)
    variance = float(np.sum(residuals**2)) / max(len(residuals) - 12, 1)
    spread = np.diag(np.linalg.pinv(J.T @ J)) * variance
    return CameraCalibration(
        X,
        Y,
        residual=float(np.sqrt(np.mean(residuals**2))),
        translation_error=float(np.sqrt(spread[3:6].sum())),
        rotation_error=float(np.sqrt(spread[:3].sum())),
        left_out=tuple(view.name for view, fits in zip(views, good, strict=True) if not fits),
    )


def board_pose(view: BoardView, k: Intrinsics) -> NDArray[np.float64]:
    """X_CB [4, 4] of one view alone."""
    K = np.array([[k.fx, 0, k.cx], [0, k.fy, k.cy], [0, 0, 1]])
    _, turn, place = cv2.solvePnP(view.p_BQ, view.uv, K, None, flags=cv2.SOLVEPNP_IPPE)
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.from_rotvec(np.ravel(turn)).as_matrix(), np.ravel(place)
    return X


def _first_guess(views: Sequence[BoardView], k: Intrinsics, world: bool) -> tuple[NDArray, NDArray]:
    """X and Y such that X X_CB = A Y for each view."""
    A = [_arm(view, world) for view in views]
    X_CB = [board_pose(view, k) for view in views]
    pairs = list(combinations(range(len(views)), 2))
    a = [A[i] @ inverse(A[j]) for i, j in pairs]
    b = [X_CB[i] @ inverse(X_CB[j]) for i, j in pairs]
    turns = [np.array([Rotation.from_matrix(X[:3, :3]).as_rotvec() for X in each]) for each in (a, b)]
    spread = np.linalg.svd(turns[0], compute_uv=False) / np.sqrt(len(pairs))
    if spread[1] < LEAST_TURN:
        raise CalibrationError(
            f"the views are turned about one axis only (a second: {np.degrees(spread[1]):.1f} degrees); "
            "tilt the camera to several sides, by 20 degrees and more"
        )
    X = np.eye(4)
    X[:3, :3] = Rotation.align_vectors(*turns)[0].as_matrix()
    # (R_a - I) t_X = R_X t_b - t_a, for all pairs.
    left = np.concatenate([each[:3, :3] - np.eye(3) for each in a])
    right = np.concatenate([X[:3, :3] @ q[:3, 3] - p[:3, 3] for p, q in zip(a, b, strict=True)])
    X[:3, 3] = np.linalg.lstsq(left, right, rcond=None)[0]
    Ys = np.array([inverse(p) @ X @ q for p, q in zip(A, X_CB, strict=True)])
    Y = np.eye(4)
    Y[:3, :3] = Rotation.from_matrix(Ys[:, :3, :3]).mean().as_matrix()
    Y[:3, 3] = np.median(Ys[:, :3, 3], axis=0)
    return X, Y


def _refined(
    views: Sequence[BoardView], k: Intrinsics, X: NDArray, Y: NDArray, world: bool
) -> tuple[NDArray, NDArray, NDArray]:
    """X and Y of least squares, and the derivatives [2N, 12] of the residuals after small motions of both."""

    def residuals(V: NDArray) -> NDArray:
        return _residuals(views, k, X @ exp_se3(V[:6]), Y @ exp_se3(V[6:]), world)

    found = least_squares(residuals, np.zeros(12), x_scale="jac", loss="soft_l1")
    jacobian = least_squares(residuals, found.x, x_scale="jac", max_nfev=1).jac
    return X @ exp_se3(found.x[:6]), Y @ exp_se3(found.x[6:]), jacobian


def _residuals(views: Sequence[BoardView], k: Intrinsics, X: NDArray, Y: NDArray, world: bool) -> NDArray:
    """How far the corners are from where they should be, [2N], pixels."""
    off = []
    for view in views:
        p_CQ = move_points(inverse(X) @ _arm(view, world) @ Y, view.p_BQ)
        p_CQ[:, 2] = np.maximum(p_CQ[:, 2], 1e-3)  # what a wrong guess puts behind the camera
        off.append((project(p_CQ, k) - view.uv).ravel())
    return np.concatenate(off)


def _arm(view: BoardView, world: bool) -> NDArray[np.float64]:
    """What the arm says of a view: the world in the tip, or the tip in the world."""
    return view.X_WE if world else inverse(view.X_WE)
