"""What earlier pushes brought, so that none is repeated in vain."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.pushing.table_map import TableMap

TOUCHED = 0.010
"""What lies within this distance, m, of where a push ended was pushed by it."""


@dataclass(frozen=True)
class TriedPush:
    """A push that was made, and whether it brought anything."""

    p_WB: NDArray[np.float64]
    """[3], its contact, m."""
    direction_W: NDArray[np.float64]
    """[2], its direction."""
    changed: bool
    """Whether the number of segmented objects or their area changed."""


@dataclass(frozen=True)
class KnownScene:
    """What a push is chosen by."""

    table: TableMap
    """objMask on the map, with binL beside it (Alg. 3, lines 1 and 2)."""
    tried: Sequence[TriedPush] = ()
    """Pushes made so far."""
    heading_W: NDArray[np.float64] | None = None
    """[2], where the tool's +x, the camera's "up", points now; turning away from it costs time. None: all
    directions are alike."""


def times_pushed(thing: NDArray[np.bool_], table: TableMap, tried: Sequence[TriedPush], d_push: float) -> int:
    """How many of the pushes made so far ended at a thing, as cells [rows, columns].

    What was pushed by `d_push`, m, lies where the tip's face stopped.
    """
    P = table.points(thing)
    ends = [push.p_WB[:2] + d_push * push.direction_W for push in tried]
    return sum(bool((np.linalg.norm(P - end, axis=1) <= TOUCHED).any()) for end in ends)


def novelty(
    b_W: NDArray, direction_W: NDArray, tried: Sequence[TriedPush], distance: float
) -> NDArray[np.float64]:
    """How unlike each of T earlier pushes are candidates with contacts [N, 2], m, and directions [N, 2].

    [N, T], from 0 for the same push to 1 for one from the other side, or from further than about twice
    `distance`, m, away.
    """
    made_W = np.array([push.p_WB[:2] for push in tried]).reshape(-1, 2)
    ahead_W = np.array([push.direction_W for push in tried]).reshape(-1, 2)
    apart = np.linalg.norm(b_W[:, None] - made_W, axis=2)
    alike = (1.0 + direction_W @ ahead_W.T) / 2
    return 1.0 - alike * np.exp(-0.5 * (apart / distance) ** 2)


@dataclass(frozen=True)
class SegmentedSoFar:
    """How much of the scene L_t covers."""

    objects: int
    """Number of object ids in sight."""
    area: float
    """Of their pixels, each counted as what it covers at its depth, m^2."""

    def differs_from(self, other: "SegmentedSoFar", minimum_area: float) -> bool:
        """Whether there are more or fewer objects, or their area changed by more than that, m^2."""
        return self.objects != other.objects or abs(self.area - other.area) > minimum_area


def segmented_so_far(mask: NDArray, depth: NDArray, intrinsics: Intrinsics) -> SegmentedSoFar:
    """What a mask L_t [H, W] covers, with the depth [H, W] of the same moment, m."""
    labelled = mask > 0
    z = depth[labelled].astype(float)
    return SegmentedSoFar(
        objects=len(np.unique(mask[labelled])),
        area=float(np.sum(z**2) / (intrinsics.fx * intrinsics.fy)),
    )
