"""Pictures of a calibration board as a pinhole takes them: exact places, soft edges, noise, uneven light."""

import cv2
import numpy as np

from riseg_drake.geometry.camera import Intrinsics

FINER = 4
"""Samples a pixel's side."""
DENSITY = 4000.0
"""Pixels a metre on the board."""


def drawn_board(board, X_CB, k: Intrinsics, rng: np.random.Generator, noise: float = 3.0) -> np.ndarray:
    """RGB [H, W, 3] of a board at a pose [4, 4] in the camera, on a gray table."""
    margin = round(0.02 * DENSITY)
    paper = cv2.copyMakeBorder(board.drawn(DENSITY), *[margin] * 4, cv2.BORDER_CONSTANT, value=255)
    K = np.array([[k.fx, 0, k.cx], [0, k.fy, k.cy], [0, 0, 1]])
    # From the middle of the paper's pixels to metres, to the picture, and to its finer one.
    metres = np.array([[1, 0, 0.5 - margin], [0, 1, 0.5 - margin], [0, 0, DENSITY]]) / DENSITY
    finer = np.array([[FINER, 0, (FINER - 1) / 2], [0, FINER, (FINER - 1) / 2], [0, 0, 1]])
    H = finer @ K @ X_CB[:3, [0, 1, 3]] @ metres
    size = (k.width * FINER, k.height * FINER)
    sharp = cv2.warpPerspective(paper, H, size, flags=cv2.INTER_AREA, borderValue=150)
    picture = cv2.resize(sharp, (k.width, k.height), interpolation=cv2.INTER_AREA).astype(float)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.6)
    light = 0.6 + 0.25 * np.linspace(0, 1, k.width)[None, :]
    gray = np.clip(30 + picture * light + rng.normal(0, noise, picture.shape), 0, 255).astype(np.uint8)
    return np.repeat(gray[..., None], 3, axis=2)
