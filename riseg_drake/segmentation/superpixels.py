"""Small pieces of an image that follow its edges: the pixels of a blank surface decide together."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from riseg_drake.geometry.nearest import nearest_values

_HEIGHT_STEPS = 2000.0
"""Gray levels a metre of height is worth beside colour: half a millimetre is one level."""
_CRUMB = 5
"""Pixels; a smaller part of a superpixel beyond a known border goes with the rest."""


@dataclass(frozen=True)
class Superpixels:
    """N pieces of a masked image, and the M borders between neighbours."""

    label: NDArray[np.intp]
    """[H, W], 0..N-1, or -1 outside the mask."""
    count: int
    """N."""
    borders: NDArray[np.intp]
    """[M, 2], the two pieces of each border, the smaller number first; rising."""
    length: NDArray[np.float64]
    """[M], pixels along each border."""
    behind: NDArray[np.bool_]
    """[M], which of them lie behind something: their sides do not touch."""
    across: NDArray[np.bool_]
    """[M], which of them lie across a gap, in which nothing seems to stand."""


def superpixels(
    color: NDArray[np.uint8], height: NDArray[np.float32], mask: NDArray[np.bool_], size: int
) -> Superpixels:
    """Cut what is masked into pieces of about `size` x `size` pixels by a watershed from a grid.

    Args:
        color: [H, W, 3], RGB.
        height: [H, W], m above the table.
        mask: [H, W], what to cut.
        size: pixels between the seeds.
    """
    image = _edges_image(color, height)
    markers = np.zeros(mask.shape, np.int32)
    seeds = np.zeros(mask.shape, bool)
    seeds[size // 2 :: size, size // 2 :: size] = True
    # Each connected piece gets a seed, however small.
    _, piece = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)
    missing = np.setdiff1d(np.unique(piece), np.unique(piece[seeds]))
    for number in missing[missing > 0]:
        v, u = np.argwhere(piece == number)[0]
        seeds[v, u] = True
    v, u = np.nonzero(seeds & mask)
    markers[v, u] = np.arange(len(v)) + 1
    markers[~mask] = len(v) + 1
    flooded = cv2.watershed(image, markers)
    own = mask & (flooded > 0) & (flooded <= len(v))
    own[v, u] = True
    flooded[v, u] = np.arange(len(v)) + 1
    # Ridges between basins, and boundaries that the outside has flooded, go to the nearest piece.
    nearest, _ = nearest_values(flooded.astype(np.intp), own)
    label = np.where(mask, nearest, 0) - 1
    return _with_borders(label, len(v))


def _edges_image(color: NDArray[np.uint8], height: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Brightness, a colour difference and height as the channels of an image [H, W, 3]."""
    smooth = cv2.GaussianBlur(color, (0, 0), 1.0)
    gray = cv2.cvtColor(smooth, cv2.COLOR_RGB2GRAY)
    warm = (smooth[..., 0].astype(np.int16) - smooth[..., 2]) // 2 + 128
    levels = np.clip(height * _HEIGHT_STEPS, 0, 255).astype(np.uint8)
    return np.stack([gray, warm.astype(np.uint8), cv2.medianBlur(levels, 5)], axis=-1)


def touching(
    label: NDArray[np.intp],
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]]:
    """Where two pieces of a label image [H, W] touch, along v, then along u: the pixel (v, u) [2, K] before the
    border, and the smaller and the larger number [K] of the two."""
    for a, b in ((label[:-1], label[1:]), (label[:, :-1], label[:, 1:])):
        pixel = np.stack(np.nonzero((a != b) & (a >= 0) & (b >= 0)))
        a, b = a[*pixel], b[*pixel]
        yield pixel, np.minimum(a, b), np.maximum(a, b)


def _with_borders(label: NDArray[np.intp], count: int) -> Superpixels:
    """Find which pieces touch, and along how many pixels."""
    size = max(count, 1) ** 2
    length = np.zeros(size)
    for _, low, high in touching(label):
        length += np.bincount(low * count + high, minlength=size)
    code = np.flatnonzero(length)
    borders = np.stack(np.divmod(code, max(count, 1)), axis=1)
    touch = np.zeros(len(code), bool)
    return Superpixels(label, count, borders, length[code], behind=touch, across=touch)


def label_middles(label: NDArray[np.intp], count: int) -> NDArray[np.float64]:
    """The middle (v, u) [N, 2], pixels, of each of `count` labels 0.. of an image [H, W]; -1 is none."""
    at = np.nonzero(label >= 0)
    owner = label[at]
    sums = np.stack([np.bincount(owner, x, count) for x in at], axis=1)
    return sums / np.maximum(np.bincount(owner, minlength=count), 1)[:, None]


def with_gaps(cut: Superpixels, widest: float) -> Superpixels:
    """The superpixels, with borders across gaps at most so many pixels wide between what is not connected.

    What is low, thin or dark is seen in pieces, as depth errs and has holes.
    """
    inside = cut.label >= 0
    _, island = cv2.connectedComponents(inside.view(np.uint8), connectivity=8)
    if island.max(initial=0) < 2:
        return cut
    nearest, distance = nearest_values(np.where(inside, cut.label, -1), inside)
    near = np.where(distance < widest / 2, nearest, -1)
    beyond = _with_borders(near, cut.count)
    of = np.zeros(cut.count, np.intp)
    of[cut.label[inside]] = island[inside]
    parted = of[beyond.borders[:, 0]] != of[beyond.borders[:, 1]]
    return with_more(cut, beyond.borders[parted], beyond.length[parted], across=True)


def with_pieces(cut: Superpixels, bodies: NDArray[np.integer]) -> Superpixels:
    """The superpixels, with borders between the pieces in which each body of a label image [H, W] is seen.

    What was one body goes on to be one, wherever other things hide the middle of it.
    """
    inside = cut.label >= 0
    owner = cut.label[inside]
    body = np.zeros(cut.count, np.intp)
    body[owner] = bodies[inside]
    area = np.bincount(owner, minlength=cut.count)
    middle = label_middles(cut.label, cut.count)
    a, b = cut.borders[body[cut.borders[:, 0]] == body[cut.borders[:, 1]]].T
    _, piece = connected_components(
        coo_array((np.ones(len(a)), (a, b)), shape=(cut.count,) * 2), directed=False
    )
    size = np.bincount(piece, area)
    pairs: list[tuple[int, int]] = []
    length: list[float] = []
    for each in np.unique(body[body > 0]):
        pieces = np.unique(piece[body == each])
        main = pieces[size[pieces].argmax()]
        tree, of_main = KDTree(middle[piece == main]), np.flatnonzero(piece == main)
        for other in pieces[pieces != main]:
            its = np.flatnonzero(piece == other)
            distance, nearest = tree.query(middle[its])
            pair = int(its[distance.argmin()]), int(of_main[nearest[distance.argmin()]])
            pairs.append((min(pair), max(pair)))
            length.append(float(np.sqrt(size[other])))
    return with_more(cut, np.array(pairs, np.intp).reshape(-1, 2), np.array(length), across=False)


def with_more(
    cut: Superpixels, pairs: NDArray[np.intp], length: NDArray[np.float64], *, across: bool
) -> Superpixels:
    """Borders between pairs [P, 2] beside those that are known, behind something or across a gap."""
    code, known = (p[:, 0] * cut.count + p[:, 1] for p in (pairs, cut.borders))
    new = ~np.isin(code, known)
    order = np.argsort(np.concatenate([known, code[new]]), kind="stable")
    kind = np.full(np.count_nonzero(new), across)
    return replace(
        cut,
        borders=np.concatenate([cut.borders, pairs[new]])[order],
        length=np.concatenate([cut.length, length[new]])[order],
        behind=np.concatenate([cut.behind, ~kind])[order],
        across=np.concatenate([cut.across, kind])[order],
    )


def split_superpixels(cut: Superpixels, bodies: NDArray[np.integer]) -> Superpixels:
    """The superpixels, split where a label image [H, W] has a border."""
    inside = cut.label >= 0
    if not inside.any():
        return cut
    count = int(bodies.max()) + 1
    code, part, pixels = np.unique(
        cut.label[inside] * count + bodies[inside], return_inverse=True, return_counts=True
    )
    of = code // count
    largest = np.empty(cut.count, np.intp)
    by_size = np.argsort(pixels, kind="stable")
    largest[of[by_size]] = by_size
    target = np.where(pixels >= _CRUMB, np.arange(len(code)), largest[of])
    label = np.full(cut.label.shape, -1, np.intp)
    kept, label[inside] = np.unique(target[part], return_inverse=True)
    return _with_borders(label, len(kept))
