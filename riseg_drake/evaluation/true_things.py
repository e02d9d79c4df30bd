"""What is true in a film, where nobody drew a label for every frame: outlines by hand in a few of its frames.

A file holds `{"things": {NAME: {"settled_at": FRAME, KIND: {FRAME: NUMBERS, ...}}}}`. KIND is "circle" (u, v,
radius, interpolated in between) or "outline" (corners (u, v), of the nearest frame). Frames count from 0, in
pixels. In a film of which nothing is said, nothing moves.
"""

import json
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

THINGS_FILE = "things.json"
"""Beside a recording's other files."""


class ThingsError(ValueError):
    """What is wrong with a file of things, in one line that names it."""


@dataclass(frozen=True)
class TrueThing:
    """One thing that moves in a film."""

    name: str
    settled_at: int
    """Frame from which on it has moved so far that it should be known as one."""
    circles: NDArray[np.float64]
    """[N, 4], frame, u, v, radius; empty if outlines are given."""
    outlines: dict[int, NDArray[np.int32]]
    """[K, 2] corners by frame; empty if circles are given."""

    def mask(self, frame: int, shape: tuple[int, int]) -> NDArray[np.bool_] | None:
        """Its pixels [H, W] in a frame; None after the last frame that is known."""
        out = np.zeros(shape, np.uint8)
        if len(self.circles):
            if frame > self.circles[-1, 0]:
                return None
            u, v, radius = (np.interp(frame, self.circles[:, 0], column) for column in self.circles[:, 1:].T)
            at_u, at_v = np.arange(shape[1]) - u, np.arange(shape[0])[:, None] - v
            return np.asarray(at_u**2 + at_v**2 <= radius**2)
        nearest = min(self.outlines, key=lambda known: abs(known - frame))
        cv2.fillPoly(out, [self.outlines[nearest]], (1,))
        return out > 0


def true_things(recording: Path) -> list[TrueThing]:
    """The things that move in a recording: as its folder says, or as this project knows them; or none.

    Raises ThingsError.
    """
    own = recording / THINGS_FILE
    known = files("riseg_drake.evaluation") / "outlines" / f"{recording.resolve().name}.json"
    if not own.is_file() and not known.is_file():
        return []
    source = own if own.is_file() else known
    try:
        return _things(json.loads(source.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ThingsError(
            f'{source} must hold {{"things": {{NAME: {{"settled_at": 0, ...}}}}}}: {error}'
        ) from None


def _things(content: dict[str, Any]) -> list[TrueThing]:
    things = []
    for name, about in content["things"].items():
        circles = [[float(frame), *map(float, numbers)] for frame, numbers in about.get("circle", {}).items()]
        outlines = {int(k): np.array(corners, np.int32) for k, corners in about.get("outline", {}).items()}
        if not circles and not outlines:
            raise ValueError(f'{name} has neither "circle" nor "outline"')
        rows = np.array(sorted(circles), float).reshape(-1, 4)
        things.append(TrueThing(name, int(about["settled_at"]), rows, outlines))
    return things
