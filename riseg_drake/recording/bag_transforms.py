"""The transforms of a bag (TF): where one frame is in another at a moment."""

from array import array
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.se3 import inverse
from riseg_drake.recording.stamped_lists import StampedTable, pose_between


class TransformTree:
    """Frames, each with one parent; fixed, or with a pose for each of some moments."""

    def __init__(self) -> None:
        self._parents: dict[str, str] = {}
        self._static: dict[str, list[float]] = {}
        self._times: dict[str, array] = {}
        self._poses: dict[str, array] = {}
        self._tables: dict[str, StampedTable] = {}

    def add(self, parent: str, child: str, time: float, pose: list[float], *, static: bool) -> None:
        """Enter a child's pose in its parent, [tx, ty, tz, qx, qy, qz, qw], at a moment, s, or for ever."""
        self._parents[child] = parent
        if static:
            self._static[child] = pose
            return
        self._times.setdefault(child, array("d")).append(time)
        self._poses.setdefault(child, array("d")).extend(pose)
        self._tables.pop(child, None)

    def frames(self) -> set[str]:
        """All that are known."""
        return set(self._parents) | set(self._parents.values())

    def ancestors(self, frame: str) -> list[str]:
        """A frame, its parent, and so on to the topmost."""
        line = [frame]
        while (parent := self._parents.get(line[-1])) is not None and parent not in line:
            line.append(parent)
        return line

    def moving(self, a: str, b: str) -> list[str]:
        """The frames between two that have no fixed pose in their parent."""
        up, down = self._between(a, b)
        return [frame for frame in up + down if frame not in self._static]

    def connected(self, a: str, b: str) -> bool:
        """Whether one frame's pose in the other can be known."""
        return self.ancestors(a)[-1] == self.ancestors(b)[-1]

    def X_AB(self, a: str, b: str, time: float, limit: float) -> NDArray[np.float64] | None:
        """The pose [4, 4] of frame b in frame a, which are connected, at a moment, s.

        None where a frame between them has no pose within `limit` s.
        """
        up, down = self._between(a, b)
        X_QA, X_QB = self._composed(up, time, limit), self._composed(down, time, limit)
        if X_QA is None or X_QB is None:
            return None
        return inverse(X_QA) @ X_QB if up else X_QB

    def _composed(self, frames: list[str], time: float, limit: float) -> NDArray[np.float64] | None:
        """The pose of the first frame in the parent of the last, [4, 4]."""
        X = np.eye(4)
        for k, frame in enumerate(frames):
            X_PF = self._pose(frame, time, limit)
            if X_PF is None:
                return None
            X = X_PF if k == 0 else X_PF @ X
        return X

    def _between(self, a: str, b: str) -> tuple[list[str], list[str]]:
        """The frames from a, and from b, up to below the first that both hang from."""
        of_a, of_b = self.ancestors(a), self.ancestors(b)
        common = next(frame for frame in of_b if frame in of_a)
        return of_a[: of_a.index(common)], of_b[: of_b.index(common)]

    def _pose(self, frame: str, time: float, limit: float) -> NDArray[np.float64] | None:
        if frame in self._static:
            # One row, at any time.
            values = np.array([self._static[frame]])
            return pose_between(StampedTable(Path(frame), [], np.zeros(1), values, np.zeros(1, int)), 0.0, 1.0)
        if frame not in self._tables:
            self._tables[frame] = stamped_table(frame, self._times[frame], self._poses[frame])
        return pose_between(self._tables[frame], time, limit)


def stamped_table(name: str, times: array, values: array, columns: list[str] | None = None) -> StampedTable:
    """Rows in the order of their times, s; of those of one time the first."""
    stamps = np.array(times, np.float64)
    _, rows = np.unique(stamps, return_index=True)
    numbers = np.array(values, np.float64).reshape(len(stamps), -1)
    return StampedTable(Path(name), columns or [], stamps[rows], numbers[rows], rows + 1)
