"""Small recordings on disk for tests: two drawn boxes on a table, the first pushed, the camera at rest."""

from pathlib import Path

import numpy as np

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.recording.writer import RecordingWriter
from tests.segmentation.drawn_scene import DrawnScene, Texture, looking_down, planar

SMALL = Intrinsics(160, 120, 154.1, 153.9, 79.2, 59.4)


def drawn_frames(
    count: int, intrinsics: Intrinsics = SMALL, rate: float = 15.0, moves: bool = True, seed: int = 0
) -> list[RecordedFrame]:
    """Frames of two boxes; the first slides by 3 mm a frame from the third frame on."""
    scene = DrawnScene(
        [(0.09, 0.08, 0.04), (0.07, 0.09, 0.05)], table=Texture(9, contrast=10), intrinsics=intrinsics
    )
    rng = np.random.default_rng(seed)
    frames = []
    for k in range(count):
        gone = 0.003 * max(0, k - 2) * moves
        X_WC = looking_down()
        frame, label = scene.frame(k, X_WC, [planar(-0.07, gone, 0.3), planar(0.07, 0.0)], rng)
        frames.append(RecordedFrame(k / rate, frame.color, frame.depth, X_WC, labels=label))
    return frames


def write(folder: Path, frames: list[RecordedFrame], intrinsics: Intrinsics = SMALL) -> Path:
    """Write frames as a recording."""
    with RecordingWriter(folder, intrinsics) as writer:
        for frame in frames:
            writer.append(frame)
    return folder
