"""BOP: a data set of one scene, as far as it can be without models and poses.

    bop/camera.json
    bop/test/000000/scene_camera.json  scene_gt.json  scene_gt_info.json
    bop/test/000000/rgb/000000.png  depth/000000.png  mask_visib/000000_000000.png ...

The layout is that of bop_toolkit's docs/bop_datasets_format.md: depth in millimetres, translations too, a mask
for each line of `scene_gt.json`, 255 on the object. `obj_id` is the object's id. What only a model tells
(`cam_R_m2c`, `cam_t_m2c`, the whole silhouette) is left out.
"""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from riseg_drake.export.segmented_frame import SegmentedFrame, bounding_box, camera_matrix
from riseg_drake.geometry.se3 import inverse
from riseg_drake.recording.whole_file import write_png, write_text
from riseg_drake.recording.writer import depth_to_millimetres

SCENE = Path("test", "000000")
DEPTH_SCALE = 1.0
"""mm for each unit of the depth image."""


class BopExport:
    """Writes images as they come, and their index at the end. Raises OSError where it cannot."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._scene = folder / SCENE
        self._intrinsics: dict[str, float] = {}
        self._camera: dict[str, Any] = {}
        self._objects: dict[str, list[dict[str, int]]] = {}
        self._info: dict[str, list[dict[str, Any]]] = {}

    def take(self, frame: SegmentedFrame) -> None:
        """Write the images of one frame."""
        for part in ("rgb", "depth", "mask_visib"):
            (self._scene / part).mkdir(parents=True, exist_ok=True)
        write_png(self._scene / "depth" / f"{frame.stem}.png", depth_to_millimetres(frame.depth))
        info = []
        for k, object_id in enumerate(frame.object_ids):
            mine = frame.mask == object_id
            write_png(self._scene / "mask_visib" / f"{frame.stem}_{k:06d}.png", mine.astype(np.uint8) * 255)
            info.append({"bbox_visib": bounding_box(mine), "px_count_visib": int(np.count_nonzero(mine))})
        write_png(self._scene / "rgb" / f"{frame.stem}.png", frame.color)
        X_CW, key = inverse(frame.X_WC), str(frame.number)
        self._camera[key] = {
            "cam_K": camera_matrix(frame.intrinsics).ravel().tolist(),
            "depth_scale": DEPTH_SCALE,
            "cam_R_w2c": X_CW[:3, :3].ravel().tolist(),
            "cam_t_w2c": (1e3 * X_CW[:3, 3]).tolist(),
        }
        self._objects[key] = [{"obj_id": object_id} for object_id in frame.object_ids]
        self._info[key] = info
        self._intrinsics = {**asdict(frame.intrinsics), "depth_scale": DEPTH_SCALE}

    def finish(self) -> list[str]:
        """Write the index of all frames."""
        if not self._camera:
            return []
        for name, content in (
            ("scene_gt_info", self._info),
            ("scene_gt", self._objects),
            ("scene_camera", self._camera),
        ):
            write_text(self._scene / f"{name}.json", json.dumps(content) + "\n")
        write_text(self._folder / "camera.json", json.dumps(self._intrinsics) + "\n")
        return []
