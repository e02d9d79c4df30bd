"""Which objects may be two that were pushed along together: worth another push.

Two bodies that touch can move as one for the length of a push. An object that hangs together by a thin
neck only is held in doubt until it has clearly moved once more, in another push: then it has either
come apart or shown that it is one.
"""

from collections.abc import Mapping, Set
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import bounding_region


@dataclass
class DoubtParameters:
    """What raises and what settles a doubt. Nothing of it is in the paper."""

    neck: float = 0.012
    """m; a connection that is narrower may be no more than two bodies touching. 0 = never in doubt."""
    part_min: float = 2.0e-4
    """m^2; what is left of each part, without a margin of half a neck, to count as one."""
    moved_flow: float = 4.0
    """Pixels that an object must move in a later push to settle the matter."""


def doubtful_ids(
    label: NDArray[np.uint16],
    born: Mapping[int, int],
    episode: int,
    moved: Mapping[int, float],
    before: Set[int],
    pixels_per_metre: float,
    parameters: DoubtParameters,
) -> frozenset[int]:
    """The ids in doubt after this frame.

    Args:
        label: [H, W], ids.
        born: the episode of motion in which each id was found.
        episode: the present one.
        moved: pixels that each id has moved since the reference frame; ids that stand still are not there.
        before: the ids in doubt so far.
        pixels_per_metre: focal length over distance.
        parameters: see there.
    """
    # Ids of the frames before that were not needed after all are gone.
    before = before & born.keys()
    settled = {a for a in before if born[a] < episode and moved.get(a, 0.0) >= parameters.moved_flow}
    young = {a for a in moved if born[a] == episode}
    radius = round(0.5 * parameters.neck * pixels_per_metre)
    if radius < 1:
        return frozenset()
    pixels_min = parameters.part_min * pixels_per_metre**2
    parted = {a for a in young if _parts(label == a, radius, pixels_min) > 1}
    return frozenset((before - settled - young) | parted)


def _parts(mask: NDArray[np.bool_], radius: int, pixels_min: float) -> int:
    """Into how many large parts a mask [H, W] falls when `radius` pixels are taken off all around."""
    if not mask.any():
        return 0
    piece = np.pad(mask[bounding_region(mask)].astype(np.uint8), 1)
    core = (cv2.distanceTransform(piece, cv2.DIST_L2, 5) > radius).astype(np.uint8)
    _, _, stats, _ = cv2.connectedComponentsWithStats(core, connectivity=4)
    return int((stats[1:, cv2.CC_STAT_AREA] >= pixels_min).sum())
