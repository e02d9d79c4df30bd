"""`--export`: what is segmented, in the formats of other tools, into the folder `export` of the output.

export/coco/  export/bop/  export/npz/  export/bundlesdf/  export/clouds/  export/poses/
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Protocol

import numpy as np
from rich.console import Console

from riseg_drake.export.bop import BopExport
from riseg_drake.export.bundlesdf import BundleSdfExport
from riseg_drake.export.clouds import CloudExport
from riseg_drake.export.coco import CocoExport
from riseg_drake.export.export_error import ExportError
from riseg_drake.export.npz import NpzExport
from riseg_drake.export.poses import write_poses
from riseg_drake.export.segmented_frame import SegmentedFrame
from riseg_drake.host.processes import undisturbed
from riseg_drake.recording import layout
from riseg_drake.segmentation.displacements import Displacements
from riseg_drake.segmentation.segmentation import Segmentation

EXPORT = "export"
"""The folder, beside what else a command writes."""


class _FrameExport(Protocol):
    def take(self, frame: SegmentedFrame) -> None: ...

    def finish(self) -> list[str]: ...


class Exports:
    """Takes every L_t of one run, and writes it in some formats. Nothing is written before the first.

    Raises ExportError for what cannot be done, before anything is written; OSError where the disk is full.
    """

    def __init__(self, output: Path, formats: Sequence[str] = (), frames: Sequence[int] = ()):
        if frames and "npz" not in formats:
            raise ExportError("--export-frames goes with --export npz only")
        folder = output / EXPORT
        makers: dict[str, Callable[[Path], _FrameExport]] = {
            "coco": CocoExport,
            "bop": BopExport,
            "npz": lambda path: NpzExport(path, frames),
            "bundlesdf": BundleSdfExport,
        }
        self.formats = tuple(dict.fromkeys(formats))
        self.notes: list[str] = []
        """What was left out and why, a line each; known at the end."""
        self._exports = [make(folder / name) for name, make in makers.items() if name in formats]
        self._clouds = CloudExport(folder / "clouds") if "clouds" in formats else None
        self._poses = folder / "poses" if "poses" in formats else None
        self._displacements = Displacements()
        self._number = 0
        self._known: tuple[int, ...] = ()

    def take(self, segmentation: Segmentation, name: str | None = None) -> None:
        """Add one L_t; `name` is the file of its colour image, as `--record` numbers them if not given."""
        seen = segmentation.frame
        if not self.formats or seen is None:
            return
        mask = segmentation.mask
        # Of what nothing was decided on yet as much is known as of what has not moved.
        shown = np.unique(mask[mask > 0]).tolist()
        confidence = dict.fromkeys(shown, segmentation.untouched_confidence) | segmentation.confidence
        frame = SegmentedFrame(
            number=self._number,
            time=seen.time,
            name=f"{layout.COLOR_FOLDER}/{self._number:06d}.png" if name is None else name,
            intrinsics=seen.intrinsics,
            color=seen.color,
            depth=seen.depth,
            X_WC=seen.X_WC,
            mask=mask,
            confidence=confidence,
        )
        with undisturbed():  # what is stopped has the same frames in all formats
            self._number += 1
            self._write(frame, segmentation)

    def _write(self, frame: SegmentedFrame, segmentation: Segmentation) -> None:
        for export in self._exports:
            export.take(frame)
        if self._clouds is not None or self._poses is not None:
            self._displacements.take(segmentation)
            self._known = segmentation.object_ids
        if self._clouds is not None:
            rest = segmentation.still_since if segmentation.decided else None
            self._clouds.take(frame, self._displacements.now, rest)

    def finish(self) -> None:
        """Write what is known at the end only."""
        for export in self._exports:
            self.notes += export.finish()
        if self._clouds is not None:
            self.notes += self._clouds.finish(self._known)
        if self._poses is not None:
            self.notes += write_poses(self._poses, self._displacements, self._known)

    def tell(self, console: Console) -> None:
        """Say where it is, and what is not."""
        for line in self.notes:
            console.print(line, highlight=False)


@contextmanager
def exporting(exports: Exports, note: Callable[..., None]) -> Iterator[Exports]:
    """Finish in the end, however that comes, and enter in the summary what came of it."""
    try:
        yield exports
    except BaseException:
        with undisturbed(), suppress(OSError, ValueError):  # what ended it is said
            exports.finish()
        raise
    with undisturbed():
        exports.finish()
        if exports.formats:
            note(exports=list(exports.formats), export_notes=exports.notes)
