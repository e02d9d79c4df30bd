"""Boards with known corners, by which cameras are calibrated: ChArUco and AprilTag, found by OpenCV."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

KINDS = ("charuco", "apriltag")
FEWEST = 8
"""Corners that must be seen of a board: fewer say little of how it is turned."""
_DRAWN = 100
"""Pixels of a square's side, or a tag's, on which the library's own convention is measured."""


@dataclass(frozen=True)
class CalibrationBoard:
    """A plane with corners whose places on it, in its frame B, are known: x right and y down on it, in m.

    `charuco`: a chess board of `columns` x `rows` squares with sides of `length`, m, and markers (5x5) of
    `other` on the white ones. `apriltag`: `columns` x `rows` tags (36h11) with sides of `length`, m, `other`
    apart.
    """

    kind: str = "charuco"
    columns: int = 7
    rows: int = 5
    length: float = 0.04
    """m"""
    other: float = 0.03
    """m"""

    def check(self) -> None:
        """Raise ValueError for a board that cannot be."""
        if self.kind not in KINDS:
            raise ValueError(f"a board is one of {', '.join(KINDS)}, not {self.kind!r}")
        if not {self.columns, self.rows} <= set(range(2, 21)):
            raise ValueError(f"a board has 2 to 20 columns and rows, not {self.columns}x{self.rows}")
        if not (0.005 <= self.length <= 0.5 and self.other > 0):
            raise ValueError("squares and tags have sides of 5 to 500 mm")
        if self.kind == "charuco" and not self.other < self.length:
            raise ValueError("markers are smaller than the squares that they stand on")

    def corners(self, gray: NDArray[np.uint8]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What of it an image [H, W] shows: p_BQ [N, 3], m, and pixels (u, v) [N, 2]; N may be 0."""
        p_BQ, uv = self._found(gray)
        return p_BQ, uv - self._shift

    def drawn(self, scale: float) -> NDArray[np.uint8]:
        """Its picture [H, W] in `scale` pixels a metre, to be printed, without a margin."""
        size = [round(side * scale) for side in self.size]
        return self._board.generateImage(size, None, 0, 1)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, m."""
        if self.kind == "charuco":
            return self.columns * self.length, self.rows * self.length
        side = self.length + self.other
        return self.columns * side - self.other, self.rows * side - self.other

    @cached_property
    def _board(self) -> Any:
        name = cv2.aruco.DICT_5X5_250 if self.kind == "charuco" else cv2.aruco.DICT_APRILTAG_36h11
        dictionary = cv2.aruco.getPredefinedDictionary(name)
        made = cv2.aruco.CharucoBoard if self.kind == "charuco" else cv2.aruco.GridBoard
        return made((self.columns, self.rows), self.length, self.other, dictionary)

    @cached_property
    def _detector(self) -> Any:
        if self.kind == "charuco":
            return cv2.aruco.CharucoDetector(self._board)
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
        return cv2.aruco.ArucoDetector(self._board.getDictionary(), parameters)

    def _found(self, gray: NDArray[np.uint8]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """As the library says it; its releases differ in the shapes of what they return."""
        if self.kind == "charuco":
            found, ids = self._detector.detectBoard(gray)[:2]
        else:
            found, ids, _ = self._detector.detectMarkers(gray)
        if ids is None or len(ids) == 0:
            return np.zeros((0, 3)), np.zeros((0, 2))
        points, pixels = self._board.matchImagePoints(found, ids)
        if points is None:
            return np.zeros((0, 3)), np.zeros((0, 2))
        return np.reshape(points, (-1, 3)).astype(float), np.reshape(pixels, (-1, 2)).astype(float)

    @cached_property
    def _shift(self) -> float:
        """By how many pixels the library's corners lie right of and below the true ones, of which (0, 0) is in
        the middle of the first pixel.

        OpenCV 4.10 is half a pixel off on ChArUco boards, OpenCV 5 is not; so it is measured on a drawn board.
        """
        scale, margin = _DRAWN / self.length, _DRAWN
        picture = cv2.copyMakeBorder(self.drawn(scale), *[margin] * 4, cv2.BORDER_CONSTANT, value=255)
        p_BQ, uv = self._found(cv2.GaussianBlur(picture, (0, 0), 1.0))
        return round(2 * float(np.median(uv - (p_BQ[:, :2] * scale + margin - 0.5)))) / 2
