"""A report to send round: one page that holds all it shows, and fetches nothing."""

import base64
import shlex
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jinja2 import Environment, StrictUndefined
from numpy.typing import NDArray

from riseg_drake.app.package import package_version
from riseg_drake.app.tables import objects_found, shares_in_percent
from riseg_drake.evaluation.scores import Scores, numbered_alike
from riseg_drake.pictures.masks import draw_masks
from riseg_drake.pictures.object_colors import object_colors

REPORT = "report.html"
"""What it is called in an output folder."""
UNSURE = 0.8
"""Below this probability that it is one object, and all of it, an object is marked."""
_QUALITY = 82
"""Of its JPEGs: 640x480 pixels are some 50 kB."""


@dataclass(frozen=True)
class View:
    """One picture of the camera in several layers of one size, as JPEG; a slider fades from one to the next."""

    caption: str
    shape: tuple[int, int]
    """(H, W), px."""
    layers: Mapping[str, bytes]
    """By name, from the lowest up."""


@dataclass(frozen=True)
class Moment:
    """What changed between two views."""

    title: str
    says: Sequence[str]
    views: Sequence[int]
    """Which of the report's views are shown side by side."""


@dataclass(frozen=True)
class FoundObject:
    """One object that was found, and how sure that is."""

    object_id: int
    confidence: float | None
    """None where nothing was decided on it."""

    @property
    def color(self) -> str:
        """That of its id, as CSS has it."""
        return "#{:02x}{:02x}{:02x}".format(*object_colors(np.array(self.object_id)))

    @property
    def is_unsure(self) -> bool:
        """Whether a person should look at it."""
        return self.confidence is not None and self.confidence < UNSURE


@dataclass(frozen=True)
class Table:
    """Figures in words."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Report:
    """All that a page shows."""

    title: str
    facts: Sequence[tuple[str, str]]
    """What was run."""
    ending: str
    """How it ended, and why."""
    views: Sequence[View]
    moments: Sequence[Moment]
    objects: Sequence[FoundObject] | None
    """None where the report is of many scenes, whose ids have nothing to do with each other."""
    doubts: Sequence[str]
    """What else is in doubt."""
    tables: Sequence[Table]


def view(
    caption: str,
    color: NDArray[np.uint8],
    mask: NDArray,
    truth: NDArray | None = None,
    confidence: Mapping[int, float] | None = None,
) -> View:
    """A picture [H, W, 3] with its mask [H, W] and, if it is known, the truth [H, W] in ids of its own, that is
    shown in those of the mask."""
    layers = {"colour": color, "masks": draw_masks(color, mask, confidence=confidence)}
    if truth is not None:
        layers["truth"] = draw_masks(color, numbered_alike(truth, mask))
    return View(caption, (len(color), len(color[0])), {name: _jpeg(layer) for name, layer in layers.items()})


def report_html(report: Report) -> str:
    """The page, as HTML."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters["data_url"] = _data_url
    template = (files("riseg_drake.app") / "report.html.jinja").read_text(encoding="utf-8")
    return environment.from_string(template).render(report=report, unsure=UNSURE)


def told_facts() -> list[tuple[str, str]]:
    """The command as it was given, where it came from the command line, and this version."""
    given = Path(sys.argv[0]).name in ("riseg", "__main__.py")
    command = [("command", shlex.join(["riseg", *sys.argv[1:]]))] if given else []
    return [*command, ("version", package_version())]


def found_objects(mask_ids: Iterable[int], confidence: Mapping[int, float]) -> list[FoundObject]:
    """The objects of these ids, the least sure first."""
    found = [FoundObject(int(object_id), confidence.get(int(object_id))) for object_id in mask_ids]
    return sorted(found, key=lambda each: (each.confidence is None, each.confidence or 0.0, each.object_id))


def scores_table(rows: Iterable[tuple[str, Scores]], first: str) -> Table:
    """The scores in percent, a row a name."""
    head = (first, "Overlap P", "R", "F", "Boundary P", "R", "F", "objects found")
    return Table(
        "Scores, in percent",
        head,
        [(name, *shares_in_percent(scores), objects_found(scores)) for name, scores in rows],
    )


def times_table(stages: Mapping[str, Mapping[str, Any]]) -> Table:
    """Calls, median and 95th percentile of every stage."""
    return Table(
        "Time of each stage",
        ("stage", "calls", "median, ms", "95th percentile, ms"),
        [
            (name, f"{figures['calls']}", f"{figures['median_ms']:.1f}", f"{figures['p95_ms']:.1f}")
            for name, figures in stages.items()
        ],
    )


def _jpeg(picture: NDArray[np.uint8]) -> bytes:
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    return cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()


def _data_url(jpeg: bytes) -> str:
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}"
