"""The smooth part of a stereo camera's error: alike over tens of pixels, and another one from each view.

Matching windows, lens residuals and what the projector throws on the scene shift disparity by a fraction of a
pixel, alike over a neighbourhood. A part of that is new in every picture; the rest belongs to the view, and
changes as the camera moves on by millimetres or turns by half a degree. A plane seen so is bent, tilts and
shifts from picture to picture, and no averaging over pixels helps.

It is drawn from a Gaussian process over pixel and pose by random Fourier features (Rahimi and Recht 2007): the
same view of the same sensor gives the same error, whenever it is asked for.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

_WAVES = 192
"""So many waves pass for a Gaussian process."""
_GRID = 4
"""Pixels between the points at which it is worked out; it is interpolated in between."""


@dataclass
class SmoothErrorParameters:
    """How large the smooth error is and how far it reaches; widths are those of a squared exponential kernel.

    Measured on a RealSense in the hand before a desk, see docs/sensing.md.
    """

    disparity_std: float = field(default=0.0, metadata={"least": 0.0, "most": 10.0})
    """Standard deviation of the disparity, px; 0: none; measured 0.2."""
    width: float = field(default=15.0, metadata={"least": 1.0, "most": 1000.0})
    """Over so many pixels it is alike."""
    flicker: float = field(default=0.5, metadata={"least": 0.0, "most": 1.0})
    """Share of its variance that is new in every picture."""
    view_shift: float = field(default=0.005, metadata={"least": 0.0001, "most": 10.0})
    """m; the camera's shift after which the rest is another one,"""
    view_turn: float = field(default=0.009, metadata={"least": 0.0001, "most": 6.3})
    """rad; and its turn."""


def smooth_error(
    shape: tuple[int, ...],
    X_WC: NDArray[np.float64],
    parameters: SmoothErrorParameters,
    seed: int,
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """Error of the disparity [H, W], px.

    Args:
        shape: (H, W).
        X_WC: pose of the camera [4, 4].
        parameters: see there.
        seed: draws the error of all views.
        rng: draws what is new in this picture.
    """
    views = np.random.default_rng([seed, _WAVES])
    wave = views.normal(0, 1 / parameters.width, (_WAVES, 2))
    by_shift = views.normal(0, 1 / parameters.view_shift, (_WAVES, 3)) @ X_WC[:3, 3]
    # A turn by a small angle changes the nine entries of a rotation by sqrt(2) of it altogether.
    by_turn = views.normal(0, 1 / (np.sqrt(2) * parameters.view_turn), (_WAVES, 9)) @ X_WC[:3, :3].ravel()
    of_view = views.uniform(0, 2 * np.pi, _WAVES) + by_shift + by_turn
    of_picture = rng.uniform(0, 2 * np.pi, _WAVES)
    kept = np.sqrt(1 - parameters.flicker) * np.exp(1j * of_view)
    amplitude = kept + np.sqrt(parameters.flicker) * np.exp(1j * of_picture)
    amplitude *= parameters.disparity_std * np.sqrt(2 / _WAVES)
    height, width = (-(-side // _GRID) for side in shape)
    # The middles of blocks of _GRID pixels, which is where enlarging the image puts its pixels.
    u, v = ((np.arange(side) + 0.5) * _GRID - 0.5 for side in (width, height))
    along_u, along_v = np.outer(wave[:, 0], u), np.outer(v, wave[:, 1])
    of_row = amplitude * np.exp(1j * along_v)
    # The real part of a sum of products of complex waves.
    left = np.hstack([of_row.real, -of_row.imag]).astype(np.float32)
    coarse = cv2.gemm(left, np.vstack([np.cos(along_u), np.sin(along_u)]).astype(np.float32), 1, None, 0)
    fine = cv2.resize(coarse, (width * _GRID, height * _GRID), interpolation=cv2.INTER_CUBIC)
    return fine[: shape[0], : shape[1]]
