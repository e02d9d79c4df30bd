"""What can be had from one image without moving anything, and without learned weights.

Both look only at what stands on the table. What they miss is what moving things brings: two toys that
touch have no depth step between them, and a pattern has colour edges where no object ends.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from skimage.segmentation import felzenszwalb

from riseg_drake.geometry.camera import Intrinsics, Region, bounding_region


@dataclass
class BaselineParameters:
    """Chosen as the best by trial on development scenes (seeds 0 to 4); lengths in m, so for any camera."""

    depth_step: float = 0.0015
    """m; neighbouring pixels that differ more in depth belong to two objects. About twice the noise of a
    difference of two pixels; a steep face is cut to pieces, and few things have one that shows."""
    area_min: float = 4.0e-4
    """m^2; a smaller segment is no object."""
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
    """Euclidean clusters of an ordered point cloud: above the table, connected without a depth step.

    Args:
        color: [H, W, 3], RGB; not looked at.
        depth: [H, W], m, 0 = invalid.
        above_table: [H, W], objMask.
        intrinsics: of the camera.
        parameters: see there.

    Returns:
        Label image [H, W], 0 = background; the largest cluster is 1.
    """
    inside = above_table & (depth > 0)
    node = np.arange(depth.size).reshape(depth.shape)
    near, far = [], []
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        connected = inside[here] & inside[there] & (np.abs(depth[here] - depth[there]) < parameters.depth_step)
        near.append(node[here][connected])
        far.append(node[there][connected])
    i, j = np.concatenate(near), np.concatenate(far)
    graph = coo_matrix((np.ones(len(i), np.uint8), (i, j)), shape=(depth.size, depth.size))
    _, cluster = connected_components(graph, directed=False)
    return _large_segments(cluster.reshape(depth.shape), inside, depth, intrinsics, parameters)


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
            min_size=round(parameters.area_min * pixels_per_area),
            channel_axis=-1,
        )
    whole = np.zeros(depth.shape, np.intp)
    whole[region] = segment
    return _large_segments(whole, inside, depth, intrinsics, parameters)


Baseline = Callable[
    [NDArray[np.uint8], NDArray[np.float32], NDArray[np.bool_], Intrinsics, BaselineParameters],
    NDArray[np.uint16],
]
BASELINES: dict[str, Baseline] = {"depth clusters": depth_clusters, "RGB-D graph": graph_segments}
"""By the name that reports give them."""


def _large_segments(
    segment: NDArray,
    inside: NDArray[np.bool_],
    depth: NDArray[np.float32],
    intrinsics: Intrinsics,
    parameters: BaselineParameters,
) -> NDArray[np.uint16]:
    """Segments numbered from the largest down, without those that are too small to be objects."""
    _, index, pixels = np.unique(segment[inside], return_inverse=True, return_counts=True)
    area = np.bincount(index, depth[inside].astype(float) ** 2) / (intrinsics.fx * intrinsics.fy)
    order = np.argsort(-pixels, kind="stable")
    kept = order[area[order] >= parameters.area_min]
    number = np.zeros(len(pixels), np.uint16)
    number[kept] = np.arange(1, len(kept) + 1)
    labels = np.zeros(segment.shape, np.uint16)
    labels[inside] = number[index]
    return labels
