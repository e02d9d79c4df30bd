"""How well a film was segmented: what was taken for an object and is none, and how the true things fared."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.evaluation.true_things import TrueThing

MOSTLY = 0.5
"""An id of which a larger share lies on a thing belongs to it."""
WITHOUT = "-"


@dataclass
class ThingScores:
    """How one true thing fared."""

    name: str
    found_ids: set[int] = field(default_factory=set)
    """All that ever lay on it."""
    overlaps: list[float] = field(default_factory=list)
    """Intersection over union with the best id, in each frame from where it should be known on."""


@dataclass
class FilmScores:
    """The scores of a film; add its frames one by one."""

    things: Sequence[TrueThing] = ()
    frames: int = 0
    """With a mask."""
    without_table: int = 0
    """Frames in which no table was found."""
    false_frames: int = 0
    """Frames with an object that is none."""
    false_pixels: int = 0
    """Pixels of these, summed over all frames."""
    seconds: list[float] = field(default_factory=list)
    """Work of one core on each frame, s."""
    of_thing: dict[str, ThingScores] = field(default_factory=dict)

    def add(
        self, number: int, mask: NDArray[np.uint16], hidden: NDArray[np.bool_] | None, seconds: float
    ) -> None:
        """Take in a frame: its number from 0, mask [H, W], what hands or a robot hide [H, W], work in s."""
        self.frames += 1
        self.seconds.append(seconds)
        seen = np.ones(mask.shape, bool) if hidden is None else ~hidden
        true = {}
        for thing in self.things:
            where = thing.mask(number, (mask.shape[0], mask.shape[1]))
            true[thing.name] = None if where is None else where & seen
        owner = _owners(mask, true)
        if all(where is not None for where in true.values()):
            false = np.isin(mask, [a for a, name in owner.items() if name is None])
            self.false_pixels += int(np.count_nonzero(false))
            self.false_frames += bool(false.any())
        for thing in self.things:
            scores = self.of_thing.setdefault(thing.name, ThingScores(thing.name))
            scores.found_ids |= {a for a, name in owner.items() if name == thing.name}
            where = true[thing.name]
            if where is not None and number >= thing.settled_at and where.any():
                scores.overlaps.append(best_overlap(mask, where))

    def as_dict(self) -> dict[str, object]:
        """The figures, as data."""
        return {
            "frames": self.frames,
            "without_table": self.without_table,
            "frames_with_a_false_object": self.false_frames,
            "false_pixels_a_frame": self.false_pixels / max(self.frames, 1),
            "ms_a_frame": 1e3 * float(np.median(self.seconds)) if self.seconds else 0.0,
            "things": {
                name: {"ids": len(scores.found_ids), "iou": float(np.mean(scores.overlaps or [0.0]))}
                for name, scores in self.of_thing.items()
            },
        }


def _owners(mask: NDArray[np.uint16], true: dict[str, NDArray[np.bool_] | None]) -> dict[int, str | None]:
    """For each id in a mask the thing that most of it lies on, or None."""
    areas = np.bincount(mask.ravel())
    owner: dict[int, str | None] = defaultdict(lambda: None)
    for a in map(int, np.flatnonzero(areas)):
        if a > 0:
            owner[a] = None
            for name, where in true.items():
                if where is not None and np.count_nonzero(where & (mask == a)) > MOSTLY * areas[a]:
                    owner[a] = name
    return owner


def best_overlap(mask: NDArray[np.uint16], where: NDArray[np.bool_]) -> float:
    """Intersection over union of a thing's pixels [H, W] with the id of a mask [H, W] that fits them best."""
    inside = np.bincount(mask[where], minlength=int(mask.max()) + 1)
    union = np.bincount(mask.ravel()) + np.count_nonzero(where) - inside
    return float((inside[1:] / union[1:]).max(initial=0.0))


def film_table(rows: Sequence[tuple[str, dict]]) -> list[str]:
    """A table in Markdown, a row for each film: its name and what `FilmScores.as_dict` says of it."""
    lines = [
        "| film | frames | no table | frames with a false object | false pixels a frame | ids for each thing "
        "| IoU | ms a frame |",
        "| --- | ---: | ---: | ---: | ---: | --- | --- | ---: |",
    ]
    for name, row in rows:
        things = row["things"]
        ids = ", ".join(f"{thing} {of['ids']}" for thing, of in things.items()) or WITHOUT
        overlaps = ", ".join(f"{thing} {of['iou']:.2f}" for thing, of in things.items()) or WITHOUT
        lines.append(
            f"| {name} | {row['frames']} | {row['without_table']} | {row['frames_with_a_false_object']} "
            f"| {row['false_pixels_a_frame']:.0f} | {ids} | {overlaps} | {row['ms_a_frame']:.0f} |"
        )
    return lines
