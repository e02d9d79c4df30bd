"""The motion of each object, as far as the segmentation knows it: a poses file in the layout of TUM RGB-D.

    poses/object_3.txt     lines: timestamp tx ty tz qx qy qz qw

The object's frame B has the axes of W at the first line, and its origin is the middle of the points that were
seen of it then; each line is its pose since, X_B0B: the first is the identity. The file's head gives p_WB of
the first line, so that X_WB = X_WB0 X_B0B.
"""

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.se3 import inverse, translation
from riseg_drake.recording.layout import pose_to_numbers
from riseg_drake.recording.whole_file import write_text
from riseg_drake.segmentation.displacements import Displacements


def relative_poses(
    track: Mapping[float, NDArray[np.float64]], p_WB: NDArray[np.float64]
) -> dict[float, NDArray[np.float64]]:
    """X_B0B [4, 4] by time, s, from displacements in W [4, 4], of a frame whose origin p_WB [3] is at first."""
    X_WB0 = translation(p_WB)
    return {time: inverse(X_WB0) @ X_W @ X_WB0 for time, X_W in track.items()}


def write_poses(folder: Path, displacements: Displacements, ids: Collection[int]) -> list[str]:
    """Write a file for each of some ids whose motion is known; returns a line for each of the others.

    Raises OSError where they cannot be written.
    """
    for a in ids:
        if a not in displacements.tracks:
            continue
        track = displacements.tracks[a]
        p_WB = displacements.middle[a]
        lines = [
            f"# motion of object {a} since the first line: X_B0B, metres and unit quaternions",
            f"# p_WB of the first line: {' '.join(repr(float(x)) for x in p_WB)}; B has the axes of W there",
            "# timestamp tx ty tz qx qy qz qw",
        ]
        for time, X_B0B in relative_poses(track, p_WB).items():
            lines.append(" ".join(repr(float(x)) for x in (time, *pose_to_numbers(X_B0B))))
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / f"object_{a}.txt", "\n".join(lines) + "\n")
    return [
        f"poses: no file for object {a}: the segmentation knows no motion of it"
        for a in ids
        if a not in displacements.tracks
    ]
