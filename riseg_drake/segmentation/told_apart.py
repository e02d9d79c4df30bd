"""Which bodies motion has told apart, remembered where they do not touch any more, or touch elsewhere.

What borders say of two bodies is gone with the last border between them: once they have parted, nothing would
keep a chain of slivers between them from making them one again. That one motion could not explain both is
true wherever they are.
"""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.segmentation.likelihood import nats_of_parts
from riseg_drake.segmentation.partition import shared_area


def identity_costs(
    told: NDArray[np.float64], body: NDArray[np.intp], area: NDArray[np.intp]
) -> NDArray[np.float64]:
    """[B, N], nats that it costs each superpixel to be one with each body that was told apart from some other.

    Args:
        told: [I, I], nats that speak against two ids' being one body.
        body: [N], ids; 0 where nothing is known.
        area: [N], pixels; a body's superpixels share in what is known of it.
    """
    ids = np.flatnonzero(told.any(1))
    ids = ids[np.isin(ids, body)]
    of_body = np.maximum(np.bincount(body, area, len(told)), 1)
    return np.asarray(told[np.ix_(ids, body)] * (area / of_body[body]))


def moving_apart(
    told: NDArray[np.float64], body: NDArray[np.intp], motion: NDArray[np.intp]
) -> NDArray[np.float64]:
    """`told` [I, I] without what a common motion contradicts.

    Ids that move as one, by the `motion` [N] of their superpixels (0 = none), may have been one body that
    seemed to be two.
    """
    of_id = np.zeros(len(told), np.intp)
    of_id[body] = motion
    return np.where((of_id == of_id[:, None]) & (of_id > 0), 0.0, told)


def with_lost(
    told: NDArray[np.float64],
    body: NDArray[np.intp],
    following: NDArray[np.intp],
    next_id: int,
    nats: NDArray[np.float64],
    area: NDArray[np.intp],
    free: float,
) -> NDArray[np.float64]:
    """[J, J] for the J = `next_id` ids that follow, by what was `told` [I, I] and what one frame says.

    Args:
        told: see above.
        body: [N], the ids of each superpixel so far.
        following: [N], its id from now on.
        next_id: the first that is free.
        nats: [G, N], how badly each motion explains each superpixel.
        area: [N], pixels.
        free: nats that it may cost two bodies to have one motion.
    """
    shared = shared_area(following, body, area, (next_id, next_id))
    # What is out of sight is what it was.
    is_here = shared.any(1)
    was = np.where(is_here, shared.argmax(1), np.arange(next_id))
    known = np.pad(told, (0, next_id - len(told)))
    # What falls off a body has a part in what was known of that.
    portion = np.where(is_here, shared.max(1) / np.maximum(shared.sum(0)[was], 1), 1.0)
    both = np.where(was == was[:, None], 0.0, known[np.ix_(was, was)] * portion[:, None] * portion)
    # Long recordings have many ids, and a picture few of them.
    ids = np.flatnonzero(is_here)
    cost = nats_of_parts(nats, (np.cumsum(is_here) - 1)[following])
    lost = (cost[:, :, None] + cost[:, None]).min(0) - cost.min(0) - cost.min(0)[:, None] - free
    both[np.ix_(ids, ids)] = np.maximum(both[np.ix_(ids, ids)], lost)
    both[0] = both[:, 0] = 0.0
    return both
