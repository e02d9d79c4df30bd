"""Contact-GraspNet: an npz file for its `inference.py --np_path`.

    npz/000123.npz     depth, K, segmap, rgb

Keys and units are those that `load_available_input_data` in its contact_graspnet/data.py reads: depth in
metres, K [3, 3], segmap with 0 for what is no object. It swaps red and blue of what it finds under `rgb`, so
that is BGR. Points nearer than 0.2 m or further than 1.8 m are left out by its own `--z_range`.
"""

import io
from collections.abc import Collection
from pathlib import Path

import numpy as np

from riseg_drake.export.segmented_frame import SegmentedFrame, camera_matrix
from riseg_drake.recording.whole_file import write_bytes


class NpzExport:
    """Writes some frames, by their number, or the last one. Raises OSError where it cannot."""

    def __init__(self, folder: Path, numbers: Collection[int] = ()):
        self._folder = folder
        self._missing = set(numbers)
        self._last: SegmentedFrame | None = None
        self._wants_last = not numbers

    def take(self, frame: SegmentedFrame) -> None:
        """Write the frame if it was asked for."""
        if frame.number in self._missing:
            self._missing.discard(frame.number)
            self._write(frame)
        self._last = frame

    def finish(self) -> list[str]:
        """Write the last frame if none was asked for; says which it is, and which never came."""
        if self._last is None:
            return []
        if self._wants_last:
            self._write(self._last)
            return [f"npz: the last frame, number {self._last.number} at {self._last.time:g} s"]
        if self._missing:
            missing = ", ".join(map(str, sorted(self._missing)))
            return [f"npz: no frame {missing}; they go from 0 to {self._last.number}"]
        return []

    def _write(self, frame: SegmentedFrame) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        buffer = io.BytesIO()
        np.savez_compressed(
            buffer,
            depth=frame.depth.astype(np.float32),
            K=camera_matrix(frame.intrinsics),
            segmap=frame.mask,
            rgb=np.ascontiguousarray(frame.color[..., ::-1]),
        )
        write_bytes(self._folder / f"{frame.stem}.npz", buffer.getvalue())
