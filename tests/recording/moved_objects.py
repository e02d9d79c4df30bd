"""One labelled RGB-D image made into a film: some of its objects move rigidly, the camera stands still.

Any image will do, real ones with their noise and holes too. Pixels of an object are taken from where they
were (bilinear in colour, nearest in depth), what an object uncovers is filled from around it, the nearer
surface hides the other, and each frame gets fresh noise on top of the image's own.
"""

from collections.abc import Iterator, Mapping

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from riseg_drake.geometry.camera import Intrinsics, project, rays
from riseg_drake.geometry.se3 import exp_se3, inverse, move_points, translation
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.segmentation.table_plane import fit_plane


def moved_film(
    color: NDArray[np.uint8],
    depth: NDArray[np.float32],
    labels: NDArray[np.uint16],
    intrinsics: Intrinsics,
    twists: Mapping[int, NDArray],
    frames: int,
    rng: np.random.Generator,
    still: int = 3,
    rate: float = 15.0,
) -> Iterator[RecordedFrame]:
    """The film, with the true labels of every frame.

    Args:
        color: [H, W, 3], RGB.
        depth: [H, W], metres, 0 = invalid.
        labels: [H, W], object ids, 0 = background.
        intrinsics: of the camera.
        twists: of each object that moves, [omega; v] a frame about its own middle, in C.
        frames: how many.
        rng: draws the noise.
        still: frames before anything moves.
        rate: frames a second.
    """
    behind_color, behind_depth = _background(color, depth, labels, intrinsics)
    for k in range(frames):
        image, z, truth = behind_color.copy(), behind_depth.copy(), np.zeros_like(labels)
        nearest = np.where(z > 0, z, np.inf)
        for label in np.unique(labels[labels > 0]):
            mine = labels == label
            V = max(0, k - still) * np.asarray(twists.get(int(label), np.zeros(6)))
            source, z_moved, z_seen = _moved_object(depth, mine, intrinsics, V)
            at = cv2.remap(mine.astype(np.uint8), source, None, cv2.INTER_NEAREST) > 0
            at &= z_moved <= nearest + 0.003
            image[at] = cv2.remap(color, source, None, cv2.INTER_LINEAR)[at]
            z[at], truth[at], nearest[at] = z_seen[at], label, z_moved[at]
        noisy = np.clip(np.rint(image + rng.normal(0, 1.5, image.shape)), 0, 255).astype(np.uint8)
        waves = cv2.GaussianBlur(rng.normal(0, 1, z.shape), (0, 0), 1.5) * 5.3  # of unit variance
        noisy_z = np.where(z > 0, np.rint((z + 0.0015 * z**2 * waves) * 1000) / 1000, 0)
        yield RecordedFrame(k / rate, noisy, noisy_z.astype(np.float32), labels=truth)


def sideways(pixels: NDArray, depth: float, intrinsics: Intrinsics, turn: float = 0.0) -> NDArray[np.float64]:
    """The twist of a motion by (du, dv) pixels a frame, and a turn about the line of sight, rad a frame."""
    du, dv = pixels
    return np.array([0, 0, turn, du * depth / intrinsics.fx, dv * depth / intrinsics.fy, 0])


def _moved_object(
    depth: NDArray[np.float32], mine: NDArray[np.bool_], intrinsics: Intrinsics, V: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Where each pixel of the moved object comes from [H, W, 2], its depth without and with holes."""
    known = mine & (depth > 0)
    rows, columns = distance_transform_edt(~known, return_distances=False, return_indices=True)
    whole = cv2.medianBlur(depth[rows, columns], 5)
    p_CQ = rays(intrinsics) * whole[..., None]
    centre = np.median(p_CQ[known], axis=0).astype(float)
    X = translation(centre) @ exp_se3(V) @ translation(-centre)
    v, u = np.mgrid[: depth.shape[0], : depth.shape[1]].astype(np.float32)
    here = np.stack([u, v], axis=-1)
    back = project(move_points(inverse(X), p_CQ), intrinsics) - here
    source = here + back.astype(np.float32)
    for _ in range(5):  # the way back starts at the moved surface, which is not known beforehand
        z_source = cv2.remap(whole, source, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        target = project(move_points(X, _points(source, z_source, intrinsics)), intrinsics)
        source = source + (here - target).astype(np.float32)
    z_source = cv2.remap(whole, source, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    z_moved = move_points(X, _points(source, z_source, intrinsics))[..., 2]
    raw = cv2.remap(depth, source, None, cv2.INTER_NEAREST)
    z_seen = np.where(raw > 0, z_moved + raw - cv2.remap(whole, source, None, cv2.INTER_NEAREST), 0)
    return source, z_moved, z_seen


def _points(uv: NDArray, z: NDArray, k: Intrinsics) -> NDArray:
    return np.stack([(uv[..., 0] - k.cx) / k.fx * z, (uv[..., 1] - k.cy) / k.fy * z, z], axis=-1)


def _background(
    color: NDArray[np.uint8], depth: NDArray[np.float32], labels: NDArray[np.uint16], intrinsics: Intrinsics
) -> tuple[NDArray, NDArray]:
    """What lies behind the objects: colour from around them, depth of the table."""
    hidden = cv2.dilate((labels > 0).astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    rows, columns = distance_transform_edt(hidden, return_distances=False, return_indices=True)
    filled = cv2.GaussianBlur(color[rows, columns], (0, 0), 3)
    plane_C = fit_plane(depth, intrinsics, np.random.default_rng(0), valid=labels == 0)
    table = -plane_C[3] / np.minimum(rays(intrinsics) @ plane_C[:3], -1e-3)
    objects = labels > 0
    return np.where(objects[..., None], filled, color), np.where(objects, table, depth).astype(np.float32)
