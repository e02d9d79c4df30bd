"""Stand-ins for Segment Anything: one that knows the truth, and several that answer nonsense."""

from collections.abc import Callable, Iterator, Sequence

import cv2
import numpy as np

from riseg_drake.learned.prompts import Answer, Prompt


class Perfect:
    """Answers with the true mask of the object under the first point, among two masks that are wrong."""

    def __init__(self, labels: np.ndarray) -> None:
        self.labels = labels

    def __call__(self, color: np.ndarray, prompts: Sequence[Prompt]) -> Iterator[Answer]:
        for prompt in prompts:
            u, v = np.rint(prompt.points[0]).astype(int)
            true = self.labels == self.labels[v, u]
            part = cv2.erode(true.astype(np.uint8), np.ones((25, 25), np.uint8)).astype(bool)
            yield answer(part, true, np.ones_like(true))


class Nonsense:
    """Answers each prompt with the same kind of rubbish, and is sure of it."""

    def __init__(self, rubbish: Callable[[np.random.Generator, tuple[int, int]], np.ndarray]) -> None:
        self.rubbish = rubbish

    def __call__(self, color: np.ndarray, prompts: Sequence[Prompt]) -> Iterator[Answer]:
        rng = np.random.default_rng(0)
        for _ in prompts:
            yield answer(*(self.rubbish(rng, color.shape[:2]) for _ in range(3)))


def _rectangle(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    mask = np.zeros(shape, bool)
    (v0, v1), (u0, u1) = (np.sort(rng.integers(0, length, 2)) for length in shape)
    mask[v0:v1, u0:u1] = True
    return mask


NONSENSE = {
    "nothing": lambda rng, shape: np.zeros(shape, bool),
    "everything": lambda rng, shape: np.ones(shape, bool),
    "noise": lambda rng, shape: rng.random(shape) < 0.5,
    "a rectangle anywhere": _rectangle,
}


def answer(*masks: np.ndarray) -> Answer:
    """Masks that the model is sure of."""
    return Answer(np.stack(masks), np.full(len(masks), 0.99), np.full(len(masks), 0.99))
