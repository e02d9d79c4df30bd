"""What stands there and was never touched, guessed: clusters of depth, of which motion has said nothing."""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.depth_clusters import DepthClusterParameters, depth_clusters
from riseg_drake.segmentation.propagation import UNKNOWN
from riseg_drake.segmentation.segmentation import Segmentation


def untouched_clusters(segmentation: Segmentation) -> NDArray[np.uint16]:
    """Clusters [H, W] of what has not moved yet, in the last frame: 1 is the largest, 0 all else.

    They are numbered anew in each frame, and are no ids: a first guess for who can't wait.
    """
    if segmentation.frame is None:
        return np.zeros(segmentation.label.shape, np.uint16)
    frame, unknown = segmentation.frame, segmentation.label == UNKNOWN
    return depth_clusters(frame.depth, unknown, frame.intrinsics, DepthClusterParameters())
