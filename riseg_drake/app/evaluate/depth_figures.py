"""How depth errs in a recording of a scene that stands still: four figures that need no ground truth."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.recording.whole_file import write_png
from riseg_drake.segmentation.above_table import AboveTable, AboveTableParameters, objects_above_table
from riseg_drake.segmentation.camera_motion import CameraMotionParameters, PoseError, settled_pair, table_change
from riseg_drake.segmentation.noise import MeasurementNoise
from riseg_drake.segmentation.optical_flow import DisFlow
from riseg_drake.segmentation.surface import seek, surface_pixels
from riseg_drake.segmentation.table_plane import NoPlaneError

DEPTH_PICTURE = "depth.png"
DISTANCES = (0.3, 0.5, 0.7, 1.0, 1.5)
"""Edges of the bins of distance, m."""
SMOOTH = 20.0
"""What is left of an error after a Gaussian of so many pixels is smooth."""
VIEWS_APART = 8
"""Frames between two views."""
PAIRS = 12
"""So many pairs of frames are compared."""
DISPARITY = 645.0 * 0.055
"""Pixels of disparity times metres, of a D415: every error is given in its disparity, whatever the camera."""
_TRIMS = 5
OTHER_SURFACE = 0.05
"""Share of its depth by which a point must not be elsewhere in the other view."""


def depth_figures(recording: Path) -> dict[str, Any]:
    """The figures of one recording, see `depth_table`. NaN where it does not show them."""
    frames = _frames(recording)
    next_one = _differences(frames, 1)
    far_one = _differences(frames, VIEWS_APART)
    by_distance = {}
    for near, far in pairwise(DISTANCES):
        inside = [
            error[(z >= near) & (z < far)]
            for error, z in ((e[np.isfinite(e)], z[np.isfinite(e)]) for e, z in next_one)
        ]
        metres = np.concatenate(inside) if inside else np.empty(0)
        by_distance[f"{near:g} to {far:g} m"] = 1e3 * _spread(metres) if len(metres) > 2000 else float("nan")
    tilt, height = _table_jitter(frames)
    gray = np.concatenate(
        [cv2.cvtColor(f.color, cv2.COLOR_RGB2GRAY)[::2, ::2][~f.robot[::2, ::2]] for f in frames]
    )
    hole = np.concatenate([(f.depth == 0)[::2, ::2][~f.robot[::2, ::2]] for f in frames])
    return {
        "noise_mm": by_distance,
        "noise_px": _median([_spread(_disparity(e, z)) for e, z in next_one]),
        "smooth_next_px": _median([_spread(_smoothed(_disparity(e, z))) for e, z in next_one]),
        "smooth_views_px": _median([_spread(_smoothed(_disparity(e, z))) for e, z in far_one]),
        "holes": float(hole.mean()),
        "holes_dark": float(hole[gray < 32].mean()) if (gray < 32).sum() > 1000 else float("nan"),
        "table_tilt_rad": tilt,
        "table_height_mm": 1e3 * height,
    }


def depth_table(figures: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """A table in Markdown: a row for each figure, a column for each recording, by name."""
    lines = [f"| | {' | '.join(figures)} |", "| --- |" + " ---: |" * len(figures)]

    def row(what: str, cells: Sequence[float], digits: int) -> None:
        shown = ("-" if np.isnan(cell) else f"{cell:.{digits}f}" for cell in cells)
        lines.append(f"| {what} | {' | '.join(shown)} |")

    for distance in next(iter(figures.values()))["noise_mm"]:
        row(f"noise at {distance}, mm", [of["noise_mm"][distance] for of in figures.values()], 1)
    for what, key, digits in (
        ("noise, px of disparity", "noise_px", 3),
        ("smooth part of it, to the next frame, px", "smooth_next_px", 3),
        (f"the same to a view {VIEWS_APART} frames on, px", "smooth_views_px", 3),
        ("without depth, share", "holes", 3),
        ("the same where gray is below 32", "holes_dark", 3),
        ("the table's tilt from frame to frame, rad", "table_tilt_rad", 4),
        ("its shift, mm", "table_height_mm", 2),
    ):
        row(what, [of[key] for of in figures.values()], digits)
    return lines


def draw_depth(recordings: Sequence[Path], file: Path) -> None:
    """One frame of each recording, colour above depth, side by side, 320 pixels wide."""
    columns = []
    for recording in recordings:
        (frame,) = _frames(recording, 1)
        z = frame.depth
        near, far = (float(np.quantile(z[z > 0], q)) for q in (0.02, 0.9)) if (z > 0).any() else (0.0, 1.0)
        level = np.clip(255 * (far - z) / max(far - near, 1e-6), 0, 255).astype(np.uint8)
        tinted = cv2.applyColorMap(level, cv2.COLORMAP_VIRIDIS)[..., ::-1].copy()
        tinted[z == 0] = 0
        both = [cv2.resize(k, (320, 240), interpolation=cv2.INTER_AREA) for k in (frame.color, tinted)]
        columns.append(np.vstack(both))
    write_png(file, np.hstack(columns))


def _frames(recording: Path, most: int | None = None) -> list[Frame]:
    reader = RecordingReader(recording)
    return [
        Frame(
            number,
            frame.time,
            reader.intrinsics,
            frame.color,
            frame.depth,
            np.eye(4) if frame.X_WC is None else frame.X_WC,
            np.zeros(frame.depth.shape, bool) if frame.robot is None else frame.robot,
        )
        for number, frame in enumerate(islice(reader, most))
    ]


def _differences(frames: Sequence[Frame], apart: int) -> list[tuple[NDArray, NDArray]]:
    """Depth of one frame as seen later, less what it should be [H, W], m; and depth. NaN where unknown."""
    numbers = range(0, len(frames) - apart, max(1, (len(frames) - apart) // PAIRS))
    return [_difference(frames[n], frames[n + apart]) for n in numbers]


def _difference(before: Frame, after: Frame) -> tuple[NDArray, NDArray]:
    flow = DisFlow()(before.color, after.color)
    # No table: what stands still in the images is all that is asked.
    nothing = AboveTable(
        np.zeros(before.depth.shape, bool), np.zeros_like(before.depth), np.array([0, 0, 1.0, 0]), 0.002, 1.0
    )
    elsewhere = replace(nothing, plane_W=np.array([0, 0, 1.0, 1.0]))
    known = PoseError(tilt_squares=2 * 0.01**2, height_squares=0.01**2, frames=1)
    noise, motion = MeasurementNoise(), CameraMotionParameters(confidence=0.5)
    pair = settled_pair(FramePair(before, after), flow, nothing, elsewhere, known, noise, motion)
    asked = (before.depth > 0) & (before.depth < DISTANCES[-1]) & ~before.robot
    pixels = surface_pixels(asked, before.depth, before.intrinsics)
    sought = seek(pixels, pair.X_C1C0)
    there = sought.read(after.unhidden_depth)
    error = np.where(there > 0, there - sought.depth, np.nan)
    error[np.abs(error) > OTHER_SURFACE * sought.depth] = np.nan
    image = np.full(before.depth.shape, np.nan)
    image[tuple(pixels.pixel)] = error
    return image, before.depth


def _disparity(error: NDArray, depth: NDArray) -> NDArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return error * DISPARITY / depth**2


def _smoothed(error: NDArray) -> NDArray:
    known = np.isfinite(error).astype(float)
    weight = cv2.GaussianBlur(known, (0, 0), SMOOTH)
    mean = cv2.GaussianBlur(np.nan_to_num(error), (0, 0), SMOOTH) / np.maximum(weight, 1e-6)
    return np.where((known > 0) & (weight > 0.8), mean, np.nan)


def _spread(error: NDArray) -> float:
    """Standard deviation of one of two measurements whose differences these are, without what is far off.

    Not by a median: depth in whole millimetres makes it 0.
    """
    known = error[np.isfinite(error)]
    if len(known) < 1000:
        return float("nan")
    for _ in range(_TRIMS):
        known = known[np.abs(known - known.mean()) <= 3.5 * known.std()]
    return float(known.std() / np.sqrt(2))


def _median(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.median(known)) if known else float("nan")


def _table_jitter(frames: Sequence[Frame]) -> tuple[float, float]:
    """Medians of the table's tilt, rad, and shift, m, from each frame to the next."""
    changes, before = [], None
    for frame in frames:
        try:
            now = frame, objects_above_table(frame, AboveTableParameters())
        except NoPlaneError:
            before = None
            continue
        if before is not None:
            tilt, height, _, _ = table_change(before[0], before[1].plane_W, now[0], now[1].plane_W)
            changes.append((float(np.linalg.norm(tilt)), abs(height)))
        before = now
    if not changes:
        return float("nan"), float("nan")
    tilt_median, height_median = np.median(np.array(changes), axis=0)
    return float(tilt_median), float(height_median)
