"""Masks of any other method, made from an evaluation's images by whoever knows how, scored beside ours."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from riseg_drake.app.evaluate.scene_folder import SceneTask
from riseg_drake.evaluation.label_folders import LabelFolderError, read_labels
from riseg_drake.evaluation.scene_result import SceneResult
from riseg_drake.evaluation.scores import Scores, score


def parse_given_masks(given: Sequence[str], taken: Sequence[str]) -> dict[str, Path]:
    """NAME=DIR, several times, as a mapping. Raises LabelFolderError.

    Args:
        given: as on the command line.
        taken: the names that other rows of the report have.
    """
    folders: dict[str, Path] = {}
    for text in given:
        name, separator, folder = text.partition("=")
        if not (name.strip() and separator and folder):
            raise LabelFolderError(f"--masks {text}: give NAME=DIR, the method's name and its folder")
        if name in folders or name in taken:
            raise LabelFolderError(f"--masks {text}: there is a method {name!r} already; give another name")
        if not Path(folder).is_dir():
            raise LabelFolderError(f"--masks {text}: {folder} is not a folder")
        folders[name] = Path(folder)
    return folders


def with_given_masks(
    results: Sequence[SceneResult], tasks: Sequence[SceneTask], folders: Mapping[str, Path]
) -> list[SceneResult]:
    """The results with the scores of the given masks among the baselines.

    `DIR/scene_003/step_1/mask.png` belongs to the images in `scene_003/step_1` of the evaluation: a folder
    that another evaluation of the same scenes left has that form, too. Raises LabelFolderError for a mask
    that is missing, or of another size than its image.
    """
    return [
        replace(
            result,
            baselines={
                **result.baselines,
                **{name: _scores(folder, result, task) for name, folder in folders.items()},
            },
        )
        for result, task in zip(results, tasks, strict=True)
    ]


def _scores(folder: Path, result: SceneResult, task: SceneTask) -> list[Scores]:
    return [_score_step(folder, task, f"step_{i}") for i in range(len(result.scores))]


def _score_step(folder: Path, task: SceneTask, step: str) -> Scores:
    path = folder / task.folder.name / step / "mask.png"
    if not path.is_file():
        raise LabelFolderError(f"{path} is missing; it must be the mask of {task.folder / step / 'color.png'}")
    mask, ground_truth = read_labels(path), read_labels(task.folder / step / "ground_truth.png")
    if mask.shape != ground_truth.shape:
        raise LabelFolderError(
            f"{path} has {mask.shape[1]}x{mask.shape[0]} pixels, "
            f"not {ground_truth.shape[1]}x{ground_truth.shape[0]}"
        )
    return score(mask, ground_truth)
