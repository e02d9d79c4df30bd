"""Draw the wooden table top: boards side by side, each with its own grain and tone.

    python -m riseg_drake.models.table.make_wood [OUTPUT]

writes wood.jpg; without OUTPUT, beside this file.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.household.printing import RESOLUTION, wood

BOARDS = 12
TEXELS = (1400, 1600)  # a millimetre each, on the built-in table


def table_top(rng: np.random.Generator) -> NDArray:
    """The picture [h, w, 3], RGB, 8 bit, with the grain along its rows."""
    height, width = TEXELS
    board = height // BOARDS
    rows = []
    for _ in range(BOARDS):
        tone = rng.uniform(0.85, 1.1)
        sheet = wood(width * RESOLUTION, board * RESOLUTION, rng, (0.58 * tone, 0.39 * tone, 0.22 * tone))
        sheet[:2] *= 0.45  # the joint
        rows.append(sheet)
    return np.round(255 * np.clip(np.vstack(rows), 0, 1)).astype(np.uint8)


def main() -> None:
    """Command line: draw it."""
    parser = argparse.ArgumentParser(description="Draw the wooden table top.")
    parser.add_argument("output", nargs="?", type=Path, default=Path(__file__).parent)
    image = table_top(np.random.default_rng(5))
    path = parser.parse_args().output / "wood.jpg"
    cv2.imwrite(str(path), image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 78])


if __name__ == "__main__":
    main()
