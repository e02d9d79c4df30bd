"""What can be had from one image without moving anything, and without learned weights.

Both look only at what stands on the table. What they miss is what moving things brings: two toys that
touch have no depth step between them, and a pattern has colour edges where no object ends.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from skimage.segmentation import felzenszwalb

from riseg_drake.geometry.camera import Intrinsics, Region, bounding_region
from riseg_drake.geometry.depth_clusters import DepthClusterParameters, large_segments
from riseg_drake.geometry.depth_clusters import depth_clusters as clusters_of


@dataclass
class BaselineParameters:
    """Chosen as the best by trial on development scenes (seeds 0 to 4); lengths in m, so for any camera."""

    clusters: DepthClusterParameters = field(default_factory=DepthClusterParameters)
    depth_weight: float = 5.0
    """What a metre of depth counts in the graph, where from black to white is 1: 20 cm are as much."""
    preference: float = 3.0e-4
    """m^2; Felzenszwalb's k, the preference for large segments, as an area: a segment so large may be as
    rough inside as from black to white."""
    smoothing: float = 0.001
    """m; standard deviation of the Gaussian by which the image is smoothed first."""


def depth_clusters(
    color: NDArray[np.uint8],
    depth: NDArray[np.float32],
    above_table: NDArray[np.bool_],
    intrinsics: Intrinsics,
    parameters: BaselineParameters,
) -> NDArray[np.uint16]:
    """Clusters of depth, ids [H, W], as they are given of things that were never touched, too.

    Args:
        color: [H, W, 3], RGB; not looked at.
        depth: [H, W], m, 0 = invalid.
        above_table: [H, W], objMask.
        intrinsics: of the camera.
        parameters: see there.
    """
    return clusters_of(depth, above_table, intrinsics, parameters.clusters)


def graph_segments(
    color: NDArray[np.uint8],
    depth: NDArray[np.float32],
    above_table: NDArray[np.bool_],
    intrinsics: Intrinsics,
    parameters: BaselineParameters,
) -> NDArray[np.uint16]:
    """Graph-based segmentation of colour and depth (Felzenszwalb and Huttenlocher, IJCV 2004).

    Arguments and answer, ids [H, W], as those of `depth_clusters`.
    """
    inside = above_table & (depth > 0)
    if not inside.any():
        return np.zeros(depth.shape, np.uint16)
    region: Region = bounding_region(inside, margin=1)
    z = float(np.median(depth[inside]))
    pixels_per_area = intrinsics.fx * intrinsics.fy / z**2
    # The table is painted over, at a depth that nothing on it has: it must not join what stands on it.
    image = np.dstack(
        [
            np.where(inside[..., None], color / np.float32(255), 0),
            np.where(inside, (depth - z) * np.float32(parameters.depth_weight), 10),
        ]
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # that four channels might be a mistake
        segment = felzenszwalb(
            image[region],
            scale=parameters.preference * pixels_per_area,
            sigma=parameters.smoothing * np.sqrt(pixels_per_area),
            min_size=round(parameters.clusters.area_min * pixels_per_area),
            channel_axis=-1,
        )
    whole = np.zeros(depth.shape, np.intp)
    whole[region] = segment
    return large_segments(whole, inside, depth, intrinsics, parameters.clusters.area_min)


Baseline = Callable[
    [NDArray[np.uint8], NDArray[np.float32], NDArray[np.bool_], Intrinsics, BaselineParameters],
    NDArray[np.uint16],
]
BASELINES: dict[str, Baseline] = {"depth clusters": depth_clusters, "RGB-D graph": graph_segments}
"""By the name that reports give them."""
