"""Draw the wooden table top: boards side by side, each with its own grain and tone.

    python -m riseg_drake.models.table.make_wood [OUTPUT]

writes wood.png; without OUTPUT, beside this file.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.household.printing import RESOLUTION, wood
from riseg_drake.models.objects.texture import write_png

BOARDS = 12
TEXELS = (840, 960)  # 1.7 mm each, on the built-in table


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
    # Five bits a channel: the file is a third as large, and a camera sees no difference.
    return (np.round(31 * np.clip(np.vstack(rows), 0, 1)) * (255 / 31)).astype(np.uint8)


def main() -> None:
    """Command line: draw it."""
    parser = argparse.ArgumentParser(description="Draw the wooden table top.")
    parser.add_argument("output", nargs="?", type=Path, default=Path(__file__).parent)
    image = table_top(np.random.default_rng(5))
    write_png(parser.parse_args().output / "wood.png", image)


if __name__ == "__main__":
    main()
