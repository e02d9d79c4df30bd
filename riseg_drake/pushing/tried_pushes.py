"""What earlier pushes brought, so that none is repeated in vain."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics


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
