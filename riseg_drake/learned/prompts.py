"""What Segment Anything is asked, and what it answers, apart from any model.

A prompt is made of an object's mask: points well inside it and spread over it, and its tight box.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Prompt:
    """One question: what is the thing here?"""

    points: NDArray[np.float64]
    """[P, 2], pixels (u, v) of the image that belong to it."""
    box: NDArray[np.float64] | None = None
    """[4], first and last pixel (u, v, u, v) of it; None: not said."""
    mask: NDArray[np.bool_] | None = None
    """[H, W], roughly it; None: not said."""


@dataclass(frozen=True)
class Answer:
    """The masks that a model proposes for one prompt: usually three, from a part to the whole."""

    masks: NDArray[np.bool_]
    """[M, H, W]."""
    scores: NDArray[np.float64]
    """[M]; the IoU with the truth that the model itself expects."""
    stability: NDArray[np.float64]
    """[M]; IoU of the masks for a stricter and a laxer threshold: sharp outlines come near 1."""


class PromptedSegmenter(Protocol):
    """What a model must do."""

    def __call__(self, color: NDArray[np.uint8], prompts: Sequence[Prompt]) -> Iterator[Answer]:
        """One answer for each prompt, in order, on an RGB image [H, W, 3].

        The prompts of one call have equally many points, and all or none a box and a mask.
        """
        ...


def prompt_of_mask(mask: NDArray[np.bool_], points: int, with_mask: bool) -> Prompt:
    """Points spread over the inside of a mask [H, W] that is not empty, its tight box, perhaps itself.

    The first point is the one deepest inside; each further one is as far as can be from those before, among
    the pixels that lie at least half as deep. A mask too small for so many names some twice.
    """
    # A rim of zeros: what touches the edge of the image is not deep inside there.
    depth = cv2.distanceTransform(np.pad(mask.astype(np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
    v, u = np.nonzero(depth >= 0.5 * depth.max())
    candidates = np.stack([u, v], axis=-1).astype(float)
    chosen = [candidates[np.argmax(depth[v, u])]]
    distance = np.full(len(candidates), np.inf)
    for _ in range(points - 1):
        distance = np.minimum(distance, np.linalg.norm(candidates - chosen[-1], axis=1))
        chosen.append(candidates[np.argmax(distance)])
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    box = np.array([columns[0], rows[0], columns[-1], rows[-1]], float)
    return Prompt(np.array(chosen), box, mask if with_mask else None)


def grid_prompts(height: int, width: int, side: int) -> list[Prompt]:
    """side x side points on a grid over an image, one prompt each."""
    u = (np.arange(side) + 0.5) * width / side - 0.5
    v = (np.arange(side) + 0.5) * height / side - 0.5
    return [Prompt(np.array([[x, y]])) for y in v for x in u]


def intersection_over_union(a: NDArray[np.bool_], b: NDArray[np.bool_]) -> float:
    """How well two masks [H, W] agree, in [0, 1]; 0 for two empty ones."""
    return int(np.count_nonzero(a & b)) / max(int(np.count_nonzero(a | b)), 1)
