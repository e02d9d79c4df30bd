"""COCO: the masks of all frames in one JSON file, run-length encoded, as instance segmentations with tracks.

    coco/annotations.json

The layout is that of https://cocodataset.org/#format-data; `track_id` and `score` are what trackers and
detectors add to it. Image ids are frame numbers, from 0; annotation ids count from 1, because the evaluation
of pycocotools takes 0 for "no match".
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from riseg_drake.export.export_error import require
from riseg_drake.export.segmented_frame import SegmentedFrame
from riseg_drake.recording.whole_file import write_text

FILE = "annotations.json"
CATEGORY = {"id": 1, "name": "object", "supercategory": "object"}


class CocoExport:
    """Collects run-length encoded masks; some 300 bytes each until they are written.

    Raises ExportError where pycocotools is missing, OSError where nothing can be written.
    """

    def __init__(self, folder: Path):
        self._mask_api = require("pycocotools.mask", "coco")
        self._folder = folder
        self._images: list[dict[str, Any]] = []
        self._annotations: list[dict[str, Any]] = []

    def take(self, frame: SegmentedFrame) -> None:
        """Add one frame; also one that shows nothing is an image."""
        height, width = frame.mask.shape
        self._images.append(
            {
                "id": frame.number,
                "file_name": frame.name,
                "width": width,
                "height": height,
                "frame_id": frame.number,
                "time_s": frame.time,
            }
        )
        for object_id in frame.object_ids:
            rle = self._mask_api.encode(np.asfortranarray(frame.mask == object_id, dtype=np.uint8))
            self._annotations.append(
                {
                    "id": len(self._annotations) + 1,
                    "image_id": frame.number,
                    "category_id": CATEGORY["id"],
                    "track_id": object_id,
                    "segmentation": {"size": rle["size"], "counts": rle["counts"].decode("ascii")},
                    "area": int(self._mask_api.area(rle)),
                    "bbox": self._mask_api.toBbox(rle).tolist(),
                    "iscrowd": 0,
                    "score": round(frame.confidence[object_id], 6),
                }
            )

    def finish(self) -> list[str]:
        """Write the file."""
        self._folder.mkdir(parents=True, exist_ok=True)
        content = {
            "info": {"description": "objects found by riseg", "version": "1.0"},
            "images": self._images,
            "annotations": self._annotations,
            "categories": [CATEGORY],
        }
        write_text(self._folder / FILE, json.dumps(content) + "\n")
        return []
