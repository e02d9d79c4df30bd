"""Each pixel gets what the nearest pixel has that has something."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class NearestPlaces:
    """The nearest known pixel of every pixel of an image."""

    number: NDArray[np.int32]
    """[H, W], the known pixel that is nearest, in OpenCV's order."""
    place: NDArray[np.intp]
    """[K + 1], where the known pixel of each number lies: its place, row by row."""

    def of(self, pixel: NDArray[np.intp]) -> NDArray[np.intp]:
        """The places [N] of the known pixels that are nearest to those at some places [N]."""
        return self.place.take(self.number.ravel().take(pixel))


def nearest_places(
    known: NDArray[np.bool_], mask_size: int = cv2.DIST_MASK_3
) -> tuple[NearestPlaces, NDArray[np.float32]]:
    """For each pixel the nearest known one of an image [H, W], and how far that is, pixels [H, W].

    Args:
        known: [H, W], one at least.
        mask_size: OpenCV's, of the distance transform: 3 is faster, 5 nearer to Euclid's distance.
    """
    distance, number = cv2.distanceTransformWithLabels(
        (~known).view(np.uint8), cv2.DIST_L2, mask_size, labelType=cv2.DIST_LABEL_PIXEL
    )
    # OpenCV numbers the known pixels in an order of its own, from 1.
    index = np.flatnonzero(known)
    place = np.zeros(len(index) + 1, np.intp)
    place[number.ravel().take(index)] = index
    return NearestPlaces(number, place), distance


def nearest_values(
    values: NDArray, known: NDArray[np.bool_], mask_size: int = cv2.DIST_MASK_3
) -> tuple[NDArray, NDArray[np.float32]]:
    """For each pixel the value of the nearest known one [H, W], and how far that is, pixels [H, W].

    Args:
        values: [H, W], of any type.
        known: [H, W], which of them count; one at least.
        mask_size: as that of `nearest_places`.
    """
    places, distance = nearest_places(known, mask_size)
    return values.ravel().take(places.place).take(places.number), distance
