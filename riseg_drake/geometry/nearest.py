"""Each pixel gets what the nearest pixel has that has something."""

import cv2
import numpy as np
from numpy.typing import NDArray


def nearest_values(
    values: NDArray, known: NDArray[np.bool_], mask_size: int = cv2.DIST_MASK_3
) -> tuple[NDArray, NDArray[np.float32]]:
    """For each pixel the value of the nearest known one [H, W], and how far that is, pixels [H, W].

    Args:
        values: [H, W], of any type.
        known: [H, W], which of them count; one at least.
        mask_size: OpenCV's, of the distance transform: 3 is faster, 5 nearer to Euclid's distance.
    """
    distance, index = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, mask_size, labelType=cv2.DIST_LABEL_PIXEL
    )
    # OpenCV numbers the known pixels in an order of its own.
    value_of = np.zeros(int(index.max()) + 1, values.dtype)
    value_of[index[known]] = values[known]
    return value_of[index], distance
