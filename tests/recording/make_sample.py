"""Makes riseg_drake/recording/sample, which `riseg segment` takes by itself, from a recorded run of its scene.

    riseg run riseg_drake/recording/sample/scenario.yaml --seed 7 --record --output out/sample
    python -m tests.recording.make_sample out/sample/recording riseg_drake/recording/sample

Fewer frames, and smaller files: colour becomes JPEG; poses and robot masks are left out, for they follow from
the joint angles. The scenario stays as it is: it holds what differs from the built-in one, and no more.
"""

import shutil
import sys
from pathlib import Path

import cv2

from riseg_drake.recording import layout

EVERY = 3
"""Of so many frames one is kept: five a second."""
QUALITY = 90
"""Of the JPEGs: what they lose is less than the sensor's noise."""
LISTS = (layout.COLOR_LIST, layout.DEPTH_LIST, layout.JOINT_LIST)


def make_sample(recording: Path, sample: Path) -> None:
    """Write the thinned copy of a recording in the place of an earlier one."""
    for name in (layout.CAMERA_FILE, layout.RUN_FILE):
        shutil.copyfile(recording / name, sample / name)
    for name in LISTS:
        head, *lines = (recording / name).read_text().splitlines()
        kept = [line.replace(".png", ".jpg") if name == layout.COLOR_LIST else line for line in lines[::EVERY]]
        (sample / name).write_text("\n".join([head, *kept]) + "\n")
    smallest = [cv2.IMWRITE_PNG_COMPRESSION, 9]
    for folder, ending, options in (
        (layout.COLOR_FOLDER, ".jpg", [cv2.IMWRITE_JPEG_QUALITY, QUALITY]),
        (layout.DEPTH_FOLDER, ".png", smallest),
        (layout.LABEL_FOLDER, ".png", smallest),
    ):
        shutil.rmtree(sample / folder, ignore_errors=True)
        (sample / folder).mkdir()
        for file in sorted((recording / folder).iterdir())[::EVERY]:
            image = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
            cv2.imwrite(str((sample / folder / file.name).with_suffix(ending)), image, options)


if __name__ == "__main__":
    make_sample(*map(Path, sys.argv[1:]))
