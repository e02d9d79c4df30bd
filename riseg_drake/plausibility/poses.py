"""Poses against images: whether the table stands still where the poses have it.

Expected flow, from depth, intrinsics and poses, is what the images must show of a table. Where they show
another, the same poses are read in the ways in which they are most often written wrongly, and the reading that
leaves the least names the reason.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import pixel_grid
from riseg_drake.geometry.se3 import inverse
from riseg_drake.plausibility.limits import PlausibilityLimits
from riseg_drake.plausibility.views import View, agreed_flow
from riseg_drake.segmentation.expected_flow import expected_flow

_LOST = 100.0
"""Pixels: as wrong as what leaves the view counts."""
_FEWEST = 300
"""Pixels with flow that a pair must have to say anything."""

Motion = Callable[[NDArray, NDArray], NDArray]
"""From two poses X_WC as they are written to the motion X_C1C0 that they stand for."""


def _turned(signs: Sequence[float]) -> Motion:
    S = np.diag([*signs, 1.0])
    return lambda X_0, X_1: S @ inverse(X_1) @ X_0 @ S


def _longer(factor: float) -> Motion:
    def motion(X_0: NDArray, X_1: NDArray) -> NDArray:
        X_C1C0 = inverse(X_1) @ X_0
        X_C1C0[:3, 3] *= factor
        return X_C1C0

    return motion


def _scalar_first(X_WC: NDArray) -> NDArray[np.float64]:
    x, y, z, w = Rotation.from_matrix(X_WC[:3, :3]).as_quat()
    read = X_WC.copy()
    read[:3, :3] = Rotation.from_quat([y, z, w, x]).as_matrix()
    return read


READINGS: dict[str, Motion] = {
    "as if they were of the world in the camera (X_CW); X_WC is wanted, their inverse": lambda a, b: (
        b @ inverse(a)
    ),
    "as if the camera's axes were OpenGL's (y up, z back); wanted are x right, y down, z ahead": _turned(
        (1, -1, -1)
    ),
    "as if quaternions had w first; wanted is qx qy qz qw": lambda a, b: (
        inverse(_scalar_first(b)) @ _scalar_first(a)
    ),
    "as if images were mirrored left to right": _turned((-1, 1, 1)),
    "as if images were upside down": _turned((-1, -1, 1)),
    "as if positions were in millimetres; wanted are metres": _longer(1e-3),
    "as if positions were in centimetres; wanted are metres": _longer(1e-2),
    **{
        f"as if depth were {factor:g} times what depth_scale in camera.json makes of it": _longer(1 / factor)
        for factor in (0.1, 0.2, 0.25, 0.5, 2.0, 4.0, 5.0, 10.0)
    },
}
"""How else the same numbers may be meant."""


@dataclass(frozen=True)
class SeenPair:
    """Two views of the same table, and the flow between them."""

    first: View
    second: View
    flow: NDArray[np.float32]
    """O [H, W, 2], pixels."""
    used: NDArray[np.bool_]
    """[H, W]: table, where there is enough of it with texture, else all with texture and depth."""

    @property
    def seen(self) -> float:
        """Median length of the flow, pixels."""
        return float(np.median(np.linalg.norm(self.flow[self.used], axis=-1)))

    def left(self, X_C1C0: NDArray, zoom: float = 1.0) -> float:
        """Median of what a motion [4, 4] leaves of the flow, pixels; of focal lengths `zoom` times as long."""
        frame = self.first.frame
        k = frame.intrinsics
        expected = expected_flow(frame.depth, X_C1C0, replace(k, fx=k.fx * zoom, fy=k.fy * zoom))
        apart = np.linalg.norm(self.flow - expected, axis=-1)[self.used]
        return float(np.median(np.where(apart < _LOST, apart, _LOST)))

    def left_after(self, X_C1C0: NDArray) -> float:
        """The same of a motion [4, 4], measured on the second image brought to where that has it: flow that
        is too long or too blank to be followed is short then, if the motion is right."""
        frame, other = self.first.frame, self.second.frame
        at = pixel_grid(*frame.depth.shape) + expected_flow(frame.depth, X_C1C0, frame.intrinsics)
        at = np.nan_to_num(at, nan=-1.0).astype(np.float32)
        brought = cv2.remap(other.color, at[..., 0], at[..., 1], cv2.INTER_LINEAR)
        seen = cv2.remap(np.ones(frame.depth.shape, np.uint8), at[..., 0], at[..., 1], cv2.INTER_NEAREST) > 0
        brought[~seen] = frame.color[~seen]
        flow, good = agreed_flow(frame, replace(other, color=brought))
        good &= seen & (self.first.table() if self.first.table()[good].sum() >= _FEWEST else frame.depth > 0)
        if good.sum() < _FEWEST:
            return np.inf
        return float(np.median(np.linalg.norm(flow[good], axis=-1)))


def seen_pair(first: View, second: View) -> SeenPair | None:
    """The pair, None where too little of it has texture and depth."""
    flow, good = agreed_flow(first.frame, second.frame)
    good &= first.frame.depth > 0
    table = good & first.table()
    used = table if table.sum() >= _FEWEST else good
    return SeenPair(first, second, flow, used) if used.sum() >= _FEWEST else None


def doubts_about_poses(
    pairs: Sequence[SeenPair], source: str | None, limits: PlausibilityLimits, pixels: float = 1.0
) -> list[str]:
    """What is wrong with the poses of pairs of views that lie a few frames apart, in one line or none.

    Args:
        pairs: with the poses in their frames.
        source: where the poses come from; None for a camera of which it is said that it stands still.
        limits: from where on that is doubted.
        pixels: one pixel of the views is so many of the images.
    """
    contradicting, stuck, asked = [], [], 0
    for pair in pairs:
        motion = _motion(pair)
        left, seen = pair.left(motion), pair.seen
        if left == seen < limits.still:
            asked += source is None
            continue
        asked += 1
        limit = max(limits.still, limits.still_share * seen)
        if left > limit and pair.left_after(motion) > limit:
            contradicting.append(pair)
            stuck.append(np.allclose(motion, np.eye(4), atol=1e-9))
    if len(contradicting) < max(2, limits.pairs * asked):
        return []
    seen = float(np.median([pair.seen for pair in contradicting]))
    if source is None:
        return [
            f"the camera moves: the table by {pixels * seen:.1f} px within a few frames, where it is said to "
            "be fixed; give its poses (groundtruth.txt or joints.csv)"
        ]
    left = float(np.median([pair.left(_motion(pair)) for pair in contradicting]))
    what = (
        f"{source}: by these poses the table does not stand still: in {len(contradicting)} of {asked} pairs of "
        f"frames they miss the flow of {pixels * seen:.1f} px by {_much(left, pixels)}"
    )
    if np.mean(stuck) > 0.5:
        return [f"{what}; they do not change while the camera moves"]
    return [f"{what}; {_reason(contradicting, left, limits, pixels)}"]


def _motion(pair: SeenPair) -> NDArray[np.float64]:
    return inverse(pair.second.frame.X_WC) @ pair.first.frame.X_WC


def _much(left: float, pixels: float) -> str:
    return f"{pixels * left:.1f} px" if left < _LOST else f"more than {pixels * _LOST:.0f} px"


def _reason(pairs: Sequence[SeenPair], left: float, limits: PlausibilityLimits, pixels: float) -> str:
    """The reading that explains the images; otherwise what there is to look at."""

    def under(reading: Motion) -> float:
        poses = [(pair.first.frame.X_WC, pair.second.frame.X_WC) for pair in pairs]
        return float(np.median([pair.left(reading(*X)) for pair, X in zip(pairs, poses, strict=True)]))

    tried = {words: under(reading) for words, reading in READINGS.items()}
    for zoom in (0.5, 2.0):
        words = f"as if fx and fy in camera.json were {zoom:g} times as long"
        tried[words] = float(np.median([pair.left(_motion(pair), zoom) for pair in pairs]))
    best = min(tried, key=lambda words: tried[words])
    if tried[best] < limits.explained * left:
        return f"{best} ({pixels * tried[best]:.1f} px)"
    return "are they of the colour camera (x right, y down, z ahead), in metres, of the images' moments?"
