"""`riseg score`: two folders of label images, ten figures."""

from pathlib import Path

from rich.console import Console

from riseg_drake.app.output_folder import to_json, write_told
from riseg_drake.app.tables import score_table
from riseg_drake.evaluation.label_folders import LabelConventions, LabelHabits, score_folders
from riseg_drake.evaluation.scores import mean_scores

MOST_ROWS = 20
"""More images than this are not listed one by one on the terminal."""


def score_command(
    predicted: Path,
    true: Path,
    json_file: Path | None,
    console: Console,
    conventions: LabelConventions | None = None,
) -> None:
    """Print the mean figures of two folders; write them, and those of every image, to a JSON file.

    Raises LabelFolderError for folders that cannot be compared, OutputError where the file cannot be written.
    """
    habits = LabelHabits()
    images = dict(score_folders(predicted, true, conventions, habits))
    mean = mean_scores(list(images.values()))
    if json_file is not None:
        content = {
            "scores": mean.as_dict(),
            "images": {name: scores.as_dict() for name, scores in images.items()},
        }
        write_told(json_file, to_json(content).encode())
    rows = [*images.items(), ("mean", mean)] if len(images) <= MOST_ROWS else [("mean", mean)]
    for line in habits.doubts():
        console.print(line, style="yellow", highlight=False, soft_wrap=True)
    console.print(f"{len(images)} image{'s' if len(images) > 1 else ''}, figures in percent")
    console.print(score_table(rows, first="\nimage"))
