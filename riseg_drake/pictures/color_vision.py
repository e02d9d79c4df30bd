"""Colours as eyes have them: how far apart two of them look, also to the colour-blind.

Colours are sRGB, [..., 3], 0 to 1.
"""

import numpy as np
from numpy.typing import NDArray

# Machado, Oliveira and Fernandes (2009), "A physiologically-based model for simulation of color vision
# deficiency", severity 1.0; they hold for linear RGB.
NORMAL = np.eye(3)
PROTANOPIA = np.array(
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
)
"""Vision without the cones for long waves."""
DEUTERANOPIA = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)
"""Vision without the cones for middle waves."""

# Ottosson (2020), "A perceptual color space for image processing": Oklab, in which equal distances look
# about equally large.
_LMS = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


def linear_from_srgb(srgb: NDArray) -> NDArray[np.float64]:
    """Linear RGB [..., 3], 0 to 1, of sRGB."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((np.maximum(srgb, 0.04045) + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(linear: NDArray) -> NDArray[np.float64]:
    """sRGB of linear RGB [..., 3]; what no screen can show is cut off at 0 and 1."""
    shown = np.clip(linear, 0.0, 1.0)
    return np.where(
        shown <= 0.0031308, 12.92 * shown, 1.055 * np.maximum(shown, 0.0031308) ** (1 / 2.4) - 0.055
    )


def as_seen(srgb: NDArray, vision: NDArray) -> NDArray[np.float64]:
    """What somebody with that vision ([3, 3], one of the matrices above) sees of colours [..., 3]."""
    return srgb_from_linear(linear_from_srgb(srgb) @ vision.T)


def oklab_from_srgb(srgb: NDArray) -> NDArray[np.float64]:
    """Lightness (0 black, 1 white), green to red, blue to yellow, [..., 3]."""
    return np.cbrt(linear_from_srgb(srgb) @ _LMS.T) @ _LAB.T


def srgb_from_oklab(lab: NDArray) -> NDArray[np.float64]:
    """The inverse, of [..., 3], for colours that a screen can show."""
    return srgb_from_linear((lab @ np.linalg.inv(_LAB).T) ** 3 @ np.linalg.inv(_LMS).T)
