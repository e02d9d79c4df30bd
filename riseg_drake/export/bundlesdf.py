"""BundleSDF and FoundationPose: a folder with the film of one object, for each id.

    bundlesdf/object_3/cam_K.txt
    bundlesdf/object_3/rgb/000012.png  depth/000012.png  masks/000012.png ...

The layout is what BundleSDF's readme asks of custom data, and what the YcbineoatReader of both reads: depth in
millimetres of 16 bits, masks with 0 for the background, equal names. Only frames that show the object are in
it: both start from the mask of the first.
"""

import os
from pathlib import Path

import numpy as np

from riseg_drake.export.segmented_frame import SegmentedFrame, camera_matrix
from riseg_drake.recording.whole_file import write_bytes, write_png, write_text
from riseg_drake.recording.writer import depth_to_millimetres


class BundleSdfExport:
    """Writes images as they come; a colour image is there once its depth and its mask are.

    Several objects share the images of a frame as hard links, where the file system has these. Raises OSError
    where nothing can be written.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self._begun: set[int] = set()

    def take(self, frame: SegmentedFrame) -> None:
        """Write one frame for each object that it shows."""
        first: Path | None = None
        for object_id in frame.object_ids:
            folder = self._folder / f"object_{object_id}"
            if object_id not in self._begun:
                self._begin(folder, frame)
                self._begun.add(object_id)
            file = f"{frame.stem}.png"
            write_png(folder / "masks" / file, (frame.mask == object_id).astype(np.uint8) * 255)
            if first is None:
                write_png(folder / "depth" / file, depth_to_millimetres(frame.depth))
                write_png(folder / "rgb" / file, frame.color)
                first = folder
            else:
                for part in ("depth", "rgb"):
                    _link(first / part / file, folder / part / file)

    def finish(self) -> list[str]:
        """Nothing is left to be written."""
        return []

    def _begin(self, folder: Path, frame: SegmentedFrame) -> None:
        for part in ("rgb", "depth", "masks"):
            (folder / part).mkdir(parents=True, exist_ok=True)
        rows = (" ".join(repr(float(x)) for x in row) for row in camera_matrix(frame.intrinsics))
        write_text(folder / "cam_K.txt", "\n".join(rows) + "\n")


def _link(source: Path, target: Path) -> None:
    """The same file under another name, or a copy."""
    try:
        os.link(source, target)
    except OSError:
        write_bytes(target, source.read_bytes())
