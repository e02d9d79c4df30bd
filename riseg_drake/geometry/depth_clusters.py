"""Euclidean clusters of an ordered point cloud: what is connected without a step of depth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from riseg_drake.geometry.camera import Intrinsics


@dataclass
class DepthClusterParameters:
    """Chosen as the best by trial on development scenes (seeds 0 to 4); lengths in m, so for any camera."""

    depth_step: float = 0.0015
    """m; neighbouring pixels that differ more in depth belong to two objects. About twice the noise of a
    difference of two pixels; a steep face is cut to pieces, and few things have one that shows."""
    area_min: float = 4.0e-4
    """m^2; a smaller cluster is no object."""


def depth_clusters(
    depth: NDArray[np.float32],
    mask: NDArray[np.bool_],
    intrinsics: Intrinsics,
    parameters: DepthClusterParameters,
) -> NDArray[np.uint16]:
    """Clusters of what a mask shows, the largest first.

    Args:
        depth: [H, W], m, 0 = invalid.
        mask: [H, W], what is looked at, such as objMask.
        intrinsics: of the camera.
        parameters: see there.

    Returns:
        Label image [H, W], 0 = background; the largest cluster is 1.
    """
    inside = mask & (depth > 0)
    node = np.arange(depth.size).reshape(depth.shape)
    near, far = [], []
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        connected = inside[here] & inside[there] & (np.abs(depth[here] - depth[there]) < parameters.depth_step)
        near.append(node[here][connected])
        far.append(node[there][connected])
    i, j = np.concatenate(near), np.concatenate(far)
    graph = coo_matrix((np.ones(len(i), np.uint8), (i, j)), shape=(depth.size, depth.size))
    _, cluster = connected_components(graph, directed=False)
    return large_segments(cluster.reshape(depth.shape), inside, depth, intrinsics, parameters.area_min)


def large_segments(
    segment: NDArray,
    inside: NDArray[np.bool_],
    depth: NDArray[np.float32],
    intrinsics: Intrinsics,
    area_min: float,
) -> NDArray[np.uint16]:
    """Segments [H, W] numbered from the largest down, without those that are too small to be objects.

    Args:
        segment: [H, W], numbers of segments >= 0.
        inside: [H, W], where they count.
        depth: [H, W], m.
        intrinsics: of the camera.
        area_min: m^2; what is smaller is no object.
    """
    _, index, pixels = np.unique(segment[inside], return_inverse=True, return_counts=True)
    area = np.bincount(index, depth[inside].astype(float) ** 2) / (intrinsics.fx * intrinsics.fy)
    order = np.argsort(-pixels, kind="stable")
    kept = order[area[order] >= area_min]
    number = np.zeros(len(pixels), np.uint16)
    number[kept] = np.arange(1, len(kept) + 1)
    labels = np.zeros(segment.shape, np.uint16)
    labels[inside] = number[index]
    return labels
