"""Segment Anything in the table, as in the paper: alone, and with our masks as prompts."""

from functools import lru_cache
from pathlib import Path

from riseg_drake.app.evaluate.scene_baselines import ObservationView, above_table
from riseg_drake.app.scenario import Scenario
from riseg_drake.evaluation.label_folders import read_labels
from riseg_drake.evaluation.scene_result import OURS_WITH_SAM, SAM, SAM_METHODS
from riseg_drake.evaluation.scores import Scores, score
from riseg_drake.learned.everything import segment_everything
from riseg_drake.learned.outlines import refine_outlines
from riseg_drake.learned.sam import SamSegmenter, load_sam


def score_sam(scenario: Scenario, run: Path, steps: int) -> dict[str, list[Scores]]:
    """The scores on the images and masks of `run/step_0` ... `run/step_{steps - 1}`.

    Raises ModelError if the scenario's folder holds no model that can be used.
    """
    segmenter = _segmenter(scenario.sam.folder, scenario.sam.device)
    views = ObservationView(scenario)
    scores: dict[str, list[Scores]] = {name: [] for name in SAM_METHODS}
    for i in range(steps):
        folder = run / f"step_{i}"
        frame = views.read(folder)
        ground_truth = read_labels(folder / "ground_truth.png")
        alone = segment_everything(
            frame.color, above_table(frame, scenario), segmenter, scenario.sam.everything
        )
        refined = refine_outlines(frame, read_labels(folder / "mask.png"), segmenter, scenario.sam.outlines)
        scores[SAM].append(score(alone, ground_truth))
        scores[OURS_WITH_SAM].append(score(refined, ground_truth))
    return scores


@lru_cache(maxsize=1)
def _segmenter(folder: str, device: str) -> SamSegmenter:
    """Loaded once for all scenes of a process."""
    return load_sam(Path(folder), device)
