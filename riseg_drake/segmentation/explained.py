"""Do the groups' motions explain what the images show? Where they do not, flow was lost (not in the paper).

Where things go farther than flow can follow, flow is made up, and so are the groups' motions. They span little,
as likely as not, so that nothing renews the reference, and every later pair with it is worse. But they do not
make the images agree.
"""

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.noise import MeasurementNoise, gray_variance
from riseg_drake.segmentation.scales import OUTLIER
from riseg_drake.segmentation.surface import seek, surface_pixels

_STEP = 3
"""Every so many pixels in both directions are asked."""


def explained_share(
    pair: FramePair,
    motions: NDArray[np.float64],
    above_0: AboveTable,
    area_min: float,
    noise: MeasurementNoise,
) -> float:
    """Of what standing still does not explain in the images, the share that any of some motions does.

    Args:
        pair: the frames of t-1 and t.
        motions: [G, 4, 4] in C0.
        above_0: what stands on the table at t-1, which is asked.
        area_min: pixels; where standing still leaves less than that unexplained, all is explained.
        noise: of the images.
    """
    asked = np.zeros_like(above_0.mask)
    asked[::_STEP, ::_STEP] = above_0.mask[::_STEP, ::_STEP]
    pixels = surface_pixels(asked, pair.reference.depth, pair.reference.intrinsics)
    v, u = pixels.pixel
    gray = pair.reference.gray[v, u]
    variance = gray_variance(pair.reference.gradient_squared[v, u], noise)

    def agrees(motion: NDArray) -> NDArray[np.float32]:
        """1 where the images agree, 0 where not, NaN where they cannot be compared."""
        residual = seek(pixels, pair.X_C1C0 @ motion).read_between(pair.current.unhidden_gray) - gray
        return np.where(np.isnan(residual), np.nan, residual**2 < OUTLIER * variance).astype(np.float32)

    moved = agrees(np.eye(4)) == 0
    if np.count_nonzero(moved) * _STEP**2 < area_min:
        return 1.0
    explained = [agrees(motion)[moved] == 1 for motion in motions]
    return float(np.any(explained, axis=0).mean()) if explained else 0.0
