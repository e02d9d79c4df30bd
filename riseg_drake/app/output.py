"""The folder a run leaves behind: pictures and masks of every step, and a summary of them all.

    summary.json
    step_0/ color.png  depth.png  mask.png  mask_color.png  untouched.png  overlay.png  ground_truth.png  ...
    step_1/ ...
    report.html

`refined.png` is there with a SAM, `ground_truth.png` where the truth is known. Whenever the run is
stopped, every step that the summary lists is there, and whole.
"""

import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from riseg_drake.app.exports import EXPORT
from riseg_drake.app.output_folder import OutputFolder
from riseg_drake.app.report_page import REPORT
from riseg_drake.app.timelines import FILE
from riseg_drake.evaluation.disturbance import Disturbance
from riseg_drake.evaluation.in_motion import InMotion
from riseg_drake.evaluation.scores import Scores
from riseg_drake.host.processes import undisturbed
from riseg_drake.pictures.masks import draw_masks
from riseg_drake.pictures.object_colors import object_colors
from riseg_drake.recording.whole_file import write_png, write_text
from riseg_drake.recording.writer import depth_to_millimetres

RECORDING = "recording"
REPLAY = "replay.html"
PARTS = "|".join([r"\.?step_\d+(\.unfinished)?", RECORDING, EXPORT, *map(re.escape, (FILE, REPLAY, REPORT))])
"""What a run puts into its folder, beside the summary."""


@dataclass(frozen=True)
class Step:
    """What is known after interaction i, L*_t above all; step 0 is before any interaction."""

    interaction_step: int
    time: float
    """Of the frame, s since the start."""
    color: NDArray[np.uint8]
    """[H, W, 3], RGB."""
    depth: NDArray[np.float32]
    """[H, W], metres, 0 = invalid."""
    mask: NDArray[np.uint16]
    """L*_t [H, W], 0 = background."""
    frames: int
    """Camera frames since the last step."""
    confidence: Mapping[int, float] = field(default_factory=dict)
    """Of each id that was decided on the probability that it is one object and all of it."""
    untouched: NDArray[np.uint16] | None = None
    """Clusters of depth among what has not moved yet [H, W], 0 elsewhere: guessed, and no ids."""
    untouched_confidence: float = 0.0
    """In each of them, of the same kind as that in ids."""
    stage_seconds: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """Wall time of every call since the last step, by stage, s."""
    ground_truth: NDArray[np.uint16] | None = None
    """[H, W], visible pixels of each object; only in simulation."""
    scores: Scores | None = None
    refined_mask: NDArray[np.uint16] | None = None
    """L*_t with sharper outlines [H, W], ids as in `mask`; only where a SAM is at work."""
    refined_scores: Scores | None = None
    disturbance: Disturbance | None = None
    """What the interaction did to the objects; only in simulation, and not in step 0."""
    in_motion: InMotion | None = None
    """How well they were segmented while they moved; the same, and only where one moved in sight."""
    moved: Mapping[float, Sequence[int]] = field(default_factory=dict)
    """By the time of each frame that counts for that, s, the true ids of what had moved."""

    @property
    def objects(self) -> int:
        """How many objects the mask shows."""
        return len(np.unique(self.mask[self.mask > 0]))


class RunFolder:
    """Writes the steps of one run into a folder of its own; see OutputFolder for what it may be.

    Raises OutputError if the folder holds anything else, where it cannot be written, or the disk is full.
    """

    def __init__(
        self, folder: Path, about: Mapping[str, Any], *, command: str = "run", overwrite: bool = False
    ):
        self.path = folder
        about = {**about, "state": "running", "steps": []}
        self._folder = OutputFolder(folder, command, PARTS, about, overwrite=overwrite)

    def write_step(self, step: Step) -> None:
        """Write one step's pictures, then enter it in the summary."""
        name = f"step_{step.interaction_step}"
        unfinished = self.path / f".{name}.unfinished"
        with self._folder.writing():
            unfinished.mkdir()
            try:
                write_png(unfinished / "color.png", step.color)
                write_png(unfinished / "depth.png", depth_to_millimetres(step.depth))
                write_png(unfinished / "mask.png", step.mask.astype(np.uint16))
                write_png(unfinished / "mask_color.png", object_colors(step.mask))
                if step.untouched is not None:
                    write_png(unfinished / "untouched.png", step.untouched)
                write_png(
                    unfinished / "overlay.png", draw_masks(step.color, step.mask, confidence=step.confidence)
                )
                if step.ground_truth is not None:
                    write_png(unfinished / "ground_truth.png", step.ground_truth.astype(np.uint16))
                with undisturbed():
                    unfinished.rename(self.path / name)
                    self.note(steps=[*self._folder.summary["steps"], _step_to_json(step)])
            finally:
                shutil.rmtree(unfinished, ignore_errors=True)

    def write_refined(self, step: Step) -> None:
        """Add the mask with sharper outlines to a step that was written before."""
        assert step.refined_mask is not None
        folder = self.path / f"step_{step.interaction_step}"
        with self._folder.writing():
            write_png(folder / "refined.png", step.refined_mask.astype(np.uint16))
        entries = self._folder.summary["steps"]
        (entry,) = (e for e in entries if e["step"] == step.interaction_step)
        entry.update(_step_to_json(step))
        self.note()

    def note(self, **entries: Any) -> None:
        """Enter something about the whole run."""
        self._folder.note(**entries)

    @property
    def summary(self) -> Mapping[str, Any]:
        """What is entered so far."""
        return self._folder.summary

    def write_report(self, page: str) -> None:
        """Write the report, as HTML."""
        with self._folder.writing(), undisturbed():
            write_text(self.path / REPORT, page)

    def close(self) -> None:
        """Let others write there."""
        self._folder.close()

    def __enter__(self) -> "RunFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def stage_figures(seconds: Mapping[str, Sequence[float]]) -> dict[str, dict[str, float]]:
    """Calls, median and 95th percentile in milliseconds of every stage that was called."""
    return {
        stage: {
            "calls": len(times),
            "median_ms": round(float(np.median(times)) * 1e3, 3),
            "p95_ms": round(float(np.percentile(times, 95)) * 1e3, 3),
        }
        for stage, times in seconds.items()
        if len(times)
    }


def confidence_figures(confidence: Mapping[int, float]) -> dict[str, float]:
    """By id, as JSON has it: a string."""
    return {str(object_id): round(sure, 3) for object_id, sure in sorted(confidence.items())}


def _step_to_json(step: Step) -> dict[str, Any]:
    content: dict[str, Any] = {
        "step": step.interaction_step,
        "time_s": round(step.time, 6),
        "frames": step.frames,
        "objects": step.objects,
        "confidence": confidence_figures(step.confidence),
        "stages": stage_figures(step.stage_seconds),
    }
    if step.untouched is not None:
        clusters = range(1, int(step.untouched.max()) + 1)
        content["untouched"] = confidence_figures(dict.fromkeys(clusters, step.untouched_confidence))
    if step.scores is not None:
        content["scores"] = step.scores.as_dict()
    if step.refined_scores is not None:
        content["refined_scores"] = step.refined_scores.as_dict()
    if step.in_motion is not None:
        content["in_motion"] = asdict(step.in_motion)
        content["moved"] = [{"time_s": time, "ids": [*ids]} for time, ids in step.moved.items()]
    if step.disturbance is not None:
        content["pushed"] = step.disturbance.pushed
        content["motions"] = {name: asdict(motion) for name, motion in step.disturbance.motions.items()}
    return content
