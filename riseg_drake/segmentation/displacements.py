"""How far each object has been moved since it was first known, chained over the keyframes of a segmentation."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.se3 import inverse, move_points, seen_from
from riseg_drake.segmentation.bodies import Bodies
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.propagation import UNKNOWN, pixels_of
from riseg_drake.segmentation.segmentation import Segmentation


class Displacements:
    """Follows one segmentation; give it each L_t once, in order.

    A segmentation tells how bodies have moved since its keyframe. An object that a frame finds has stood at the
    keyframe as it was first seen, so its track begins there. What is out of sight keeps its place, as it does
    in the segmentation's memory. Where a frame was missed, so that a motion cannot be chained, that
    object's track ends. The literal paper's segmentation keeps no motion: then nothing is known of any id.
    """

    def __init__(self) -> None:
        self.tracks: dict[int, dict[float, NDArray[np.float64]]] = {}
        """By id, by time in s: the motion in W [4, 4] since the first pose."""
        self.middle: dict[int, NDArray[np.float64]] = {}
        """By id, p_W [3], the middle of what was seen of it at its first pose, m."""
        self._at_keyframe: dict[int, NDArray[np.float64]] = {}
        self._now: dict[int, NDArray[np.float64]] = {}
        self._lost: set[int] = set()
        self._fresh: set[int] = set()  # found since the keyframe
        self._before: Segmentation | None = None

    @property
    def now(self) -> dict[int, NDArray[np.float64]]:
        """By id, the motion in W [4, 4] from the first pose to the last frame; without ids that were lost."""
        return {a: X for a, X in self._now.items() if a not in self._lost}

    def take(self, segmentation: Segmentation) -> None:
        """Follow to the next frame."""
        before, self._before = self._before, segmentation
        bodies = segmentation.bodies.get(segmentation.sequence)
        if segmentation.belief is None or bodies is None or segmentation.frame is None:
            return
        keyframe = segmentation.belief.keyframe
        ids = np.unique(bodies.body[bodies.body > 0]).tolist()
        for a in self._fresh - set(ids):  # it was found in motion, and is gone; its number may be given again
            for known in (self.tracks, self.middle, self._at_keyframe, self._now):
                known.pop(a, None)
            self._fresh.discard(a)
        renewed = before is None or before.belief is None or before.belief.keyframe is not keyframe
        for a in ids:
            if renewed:
                self._follow_to_keyframe(a, before, segmentation)
            else:
                if a not in self._at_keyframe:
                    self._begin(a, keyframe.frame.time, np.eye(4), _middle(keyframe, bodies, a))
                    self._at_keyframe[a] = np.eye(4)
                    self._fresh.add(a)
                X_W = seen_from(keyframe.frame.X_WC, _motion_of(bodies, a))
                self._now[a] = X_W @ self._at_keyframe[a]
            if a not in self._lost:
                self.tracks[a][segmentation.frame.time] = self._now[a]
        if renewed:
            self._at_keyframe, self._fresh = dict(self._now), set()

    def _follow_to_keyframe(self, a: int, before: Segmentation | None, now: Segmentation) -> None:
        """From the frame before to one that has become the keyframe, and tells how things had stood then."""
        assert now.belief is not None
        assert now.frame is not None
        keyframe, bodies = now.belief.keyframe, now.bodies[now.sequence]
        middle = _middle(keyframe, bodies, a)
        then = None if before is None else now.bodies.get(before.sequence)
        if before is None or before.frame is None or then is None:
            if a in self._now:
                self._lost.add(a)
            else:
                self._begin(a, now.frame.time, np.eye(4), middle)
            self._now.setdefault(a, np.eye(4))
            return
        since = _motion_of(bodies, a) @ inverse(_motion_of(then, a))
        X_W = seen_from(keyframe.frame.X_WC, since)
        if a not in self._now:
            p_W = move_points(inverse(X_W), middle)
            # What has come off another body goes on from where that one was; else it stood as in the keyframe.
            apart = _label_at(before, p_W) not in (0, int(UNKNOWN))
            first = before.frame if apart or before.belief is None else before.belief.keyframe.frame
            self._begin(a, first.time, np.eye(4), p_W)
        self._now[a] = X_W @ self._now.get(a, np.eye(4))

    def _begin(self, a: int, time: float, X_W: NDArray[np.float64], middle: NDArray[np.float64]) -> None:
        self.tracks[a] = {time: X_W}
        self.middle[a] = middle


def _motion_of(bodies: Bodies, a: int) -> NDArray[np.float64]:
    """[4, 4], in the keyframe's camera, since the keyframe; standing still where it is not among them."""
    mine = np.flatnonzero(bodies.body == a)
    return bodies.motions_K[bodies.motion[mine[0]]] if len(mine) else np.eye(4)


def _middle(keyframe: Keyframe, bodies: Bodies, a: int) -> NDArray[np.float64]:
    """p_W [3], the mean of what a keyframe sees of an object."""
    frame = keyframe.frame
    v, u = keyframe.points.pixel
    mine = (bodies.body == a)[keyframe.owner]
    if not mine.any():
        return np.zeros(3)
    p_KQ = rays(frame.intrinsics)[v[mine], u[mine]].astype(float) * keyframe.points.depth[mine, None]
    return move_points(frame.X_WC, p_KQ.mean(0))


def _label_at(segmentation: Segmentation, p_W: NDArray[np.float64]) -> int:
    """The label where a point p_W [3] should be seen; 0 outside of the image."""
    assert segmentation.frame is not None
    frame = segmentation.frame
    vu, inside = pixels_of(move_points(inverse(frame.X_WC), p_W[None]), frame.intrinsics)
    return int(segmentation.label[vu[0, 0], vu[0, 1]]) if inside[0] else 0
