"""What stands where nothing stood before has moved, though no motion was found that brought it there.

A can that falls off a pile, a ball that rolls away, a thing that somebody puts down: they have turned too far
for any search, and nothing of them is where it was. That they have moved is as sure as can be.
"""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.se3 import inverse
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.surface import seek, surface_pixels

_FREE = 0.015
"""m; what was seen so much farther away left this place free: more than depth errs and low things are high."""
_MOST = 0.5
"""Share of a superpixel's pixels, and of a part's superpixels by area."""


def have_come(old: Keyframe, new: Keyframe) -> NDArray[np.bool_]:
    """[N], which superpixels of a new keyframe stand where the old one saw something behind that place."""
    pixels = surface_pixels(new.image_of(np.ones(new.count, bool)), new.frame.depth, new.frame.intrinsics)
    owner = new.image_of(np.arange(new.count)).ravel().take(pixels.index)
    then = seek(pixels, inverse(old.frame.X_WC) @ new.frame.X_WC)
    free = then.read(old.frame.depth) > then.depth + _FREE
    return np.asarray(np.bincount(owner[free], minlength=new.count) > _MOST * new.area)


def with_arrivals(
    body: NDArray[np.intp],
    part: NDArray[np.intp],
    come: NDArray[np.bool_],
    area: NDArray[np.intp],
    area_min: float,
    next_id: int,
) -> tuple[NDArray[np.intp], int]:
    """Ids [N] with those of parts that came, as far as nothing is known of them yet, and the next free one.

    A part of which more is known than not is that, and has turned.

    Args:
        body: [N], ids; 0 where nothing is known to have moved.
        part: [N], 0.., of each superpixel.
        come: [N], see `have_come`.
        area: [N], pixels.
        area_min: pixels of what is large enough for a body.
        next_id: the first that is free.
    """
    known, unknown, came = (
        np.bincount(part, each * area) for each in (body > 0, body == 0, come & (body == 0))
    )
    fresh = np.flatnonzero((known < unknown) & (came > _MOST * unknown) & (unknown >= area_min))
    id_of = np.zeros(len(known), np.intp)
    id_of[fresh] = next_id + np.arange(len(fresh))
    return np.where(body > 0, body, id_of[part]), next_id + len(fresh)
