"""Segment Anything, first and second version, from a local folder, through the `transformers` library.

Neither torchvision nor an image processor is needed: an image is scaled, normalised and padded here. Imports
torch and transformers only when a model is loaded.
"""

import json
import os
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.host.files import MOST_SETTINGS, read_text
from riseg_drake.learned.everything import EverythingParameters
from riseg_drake.learned.model_error import ModelError, require, torch_device
from riseg_drake.learned.outlines import OutlineParameters
from riseg_drake.learned.prompts import Answer, Prompt

MODELS = {"sam": "SamModel", "sam2": "Sam2Model", "sam2_video": "Sam2Model"}
"""The class for each `model_type` in a folder's config.json; SAM 2's images and videos share their weights."""
_MEAN = np.array((0.485, 0.456, 0.406), np.float32)
_DEVIATION = np.array((0.229, 0.224, 0.225), np.float32)
"""Of the colours of the images that both were trained on (ImageNet's)."""
_MASK_LOGIT = 10.0
"""How sure a mask prompt is, as the models would say it themselves."""
_STABILITY_OFFSET = 1.0
"""Between the strict and the lax threshold and the usual one, logits (as in SAM's mask generator)."""


@dataclass
class SamParameters:
    """Segment Anything with weights from a folder; docs/learned.md says where they come from."""

    folder: str = ""
    """With `config.json` and `model.safetensors`; empty: SAM is not used."""
    device: str = "auto"
    """"auto" (the GPU if there is one), "cpu", "cuda" ..."""
    outlines: OutlineParameters = field(default_factory=OutlineParameters)
    everything: EverythingParameters = field(default_factory=EverythingParameters)


@dataclass(frozen=True)
class _Scaling:
    """How an image becomes the model's square."""

    size: tuple[int, int]
    """(height, width) of the image."""
    scaled: tuple[int, int]
    """(height, width) of its picture in the square's upper left corner; the rest is padding."""
    side: int

    def uv(self, uv: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where pixels (u, v) [..., 2] of the image are in the square. Centres of pixels go to centres."""
        factor = np.array(self.scaled[::-1]) / np.array(self.size[::-1])
        return (uv + 0.5) * factor - 0.5

    def to_square(self, image: NDArray, interpolation: int) -> NDArray:
        """An image [H, W, ...] in the square, zeros around it."""
        scaled = cv2.resize(image, self.scaled[::-1], interpolation=interpolation)
        margin = [(0, self.side - length) for length in self.scaled]
        return np.pad(scaled, margin + [(0, 0)] * (image.ndim - 2))

    def from_square(self, image: NDArray[np.float32]) -> NDArray[np.float32]:
        """What a picture of the square [h, h], of any resolution, says about the image [H, W]."""
        whole = cv2.resize(image, (self.side, self.side), interpolation=cv2.INTER_LINEAR)
        inside = np.ascontiguousarray(whole[: self.scaled[0], : self.scaled[1]])
        return cv2.resize(inside, self.size[::-1], interpolation=cv2.INTER_LINEAR)


class SamSegmenter:
    """`PromptedSegmenter` by transformers' SamModel or Sam2Model: half precision on the GPU."""

    def __init__(self, model: Any, device: str = "auto", batch: int = 8) -> None:
        """Prepare a model; `batch` prompts are answered at a time. ModelError: no such device."""
        self._device, self._batch = torch_device(device), batch
        self._model = model.eval().to(self._device)
        self._is_second = type(model).__name__ == "Sam2Model"
        prompting = model.config.prompt_encoder_config
        self._side = int(prompting.image_size)
        self._mask_side = 4 * (self._side // int(prompting.patch_size))

    def __call__(self, color: NDArray[np.uint8], prompts: Sequence[Prompt]) -> Iterator[Answer]:
        """Answers in the order of the prompts; the image [H, W, 3] is looked at once."""
        import torch

        scaling = self.scaling(*color.shape[:2])
        half = torch.autocast("cuda", torch.float16, enabled=self._device.startswith("cuda"))
        with torch.inference_mode(), half:
            seen = self._model.get_image_embeddings(self.pixels(color, scaling))
        for first in range(0, len(prompts), self._batch):
            some = prompts[first : first + self._batch]
            with torch.inference_mode(), half:
                said = self._model(
                    image_embeddings=self._repeated(seen, len(some)),
                    multimask_output=True,
                    **self.inputs(some, scaling),
                )
            logits = said.pred_masks[:, 0].float().cpu().numpy()  # [N, M, h, h]
            scores = said.iou_scores[:, 0].float().cpu().numpy()
            for each, score in zip(logits, scores, strict=True):
                yield _answer(np.stack([scaling.from_square(one) for one in each]), score)

    def scaling(self, height: int, width: int) -> _Scaling:
        """SAM keeps the proportions of an image and pads it, SAM 2 stretches it to a square."""
        if self._is_second:
            return _Scaling((height, width), (self._side, self._side), self._side)
        factor = self._side / max(height, width)
        scaled = (int(height * factor + 0.5), int(width * factor + 0.5))
        return _Scaling((height, width), scaled, self._side)

    def pixels(self, color: NDArray[np.uint8], scaling: _Scaling) -> Any:
        """The image as the models want it, [1, 3, side, side]; the padding is 0 after normalisation."""
        import torch

        normal = (color.astype(np.float32) / 255 - _MEAN) / _DEVIATION
        shrinks = max(scaling.scaled) < max(scaling.size)
        square = scaling.to_square(normal, cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)
        return torch.from_numpy(square).permute(2, 0, 1)[None].contiguous().to(self._device)

    def inputs(self, prompts: Sequence[Prompt], scaling: _Scaling) -> dict[str, Any]:
        """The prompts as the models want them: as so many images with one question each.

        That way every prompt can have a mask of its own.
        """
        import torch

        points = np.stack([scaling.uv(prompt.points) for prompt in prompts])[:, None]
        inputs = {
            "input_points": torch.from_numpy(points.astype(np.float32)),
            "input_labels": torch.ones(points.shape[:3], dtype=torch.int64),
        }
        boxes = [prompt.box for prompt in prompts if prompt.box is not None]
        if boxes:
            corners = scaling.uv(np.stack(boxes).reshape(-1, 2, 2)).reshape(-1, 1, 4)
            inputs["input_boxes"] = torch.from_numpy(corners.astype(np.float32))
        masks = [prompt.mask for prompt in prompts if prompt.mask is not None]
        if masks:
            inputs["input_masks"] = torch.from_numpy(np.stack([self._mask(m, scaling) for m in masks]))[:, None]
        return {name: tensor.to(self._device) for name, tensor in inputs.items()}

    def _mask(self, mask: NDArray[np.bool_], scaling: _Scaling) -> NDArray[np.float32]:
        """Logits [h, h] of a mask [H, W] in the square."""
        square = scaling.to_square(mask.astype(np.float32), cv2.INTER_LINEAR)
        small = cv2.resize(square, (self._mask_side, self._mask_side), interpolation=cv2.INTER_AREA)
        return np.float32(_MASK_LOGIT) * (2 * small - 1)

    def _repeated(self, seen: Any, times: int) -> Any:
        if isinstance(seen, list | tuple):  # SAM 2 has several resolutions
            return [each.expand(times, -1, -1, -1) for each in seen]
        return seen.expand(times, -1, -1, -1)


def load_sam(folder: Path, device: str = "auto") -> SamSegmenter:
    """The model of a folder; nothing is ever fetched from a hub.

    Raises ModelError: no transformers, no folder, another model, weights that lack something, no device.
    """
    if not os.path.isdir(folder):
        raise ModelError(f"{folder} is no folder; give the one that a SAM was saved in (see docs/learned.md)")
    try:
        kind = json.loads(read_text(folder / "config.json", MOST_SETTINGS))["model_type"]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise ModelError(
            f"{folder} holds no config.json that names a model_type, as transformers saves it"
        ) from None
    if not isinstance(kind, str) or kind not in MODELS:
        raise ModelError(f"{folder} holds a model of type {kind!r}; this project knows {', '.join(MODELS)}")
    require("torch", extra="sam")
    transformers = require("transformers", extra="sam")
    try:
        transformers.utils.logging.disable_progress_bar()
        model_class = getattr(transformers, MODELS[kind])
        with warnings.catch_warnings(action="ignore"):  # what is wrong is an error below, in words of its own
            model, loading = model_class.from_pretrained(
                folder, local_files_only=True, output_loading_info=True
            )
    except Exception as error:  # whatever transformers and safetensors have to say
        raise ModelError(f"{folder}: {' '.join(str(error).split())[:300]}") from None
    missing = sorted(loading["missing_keys"])
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        raise ModelError(f"{folder} is no whole {MODELS[kind]}: it lacks {missing[0]}{more}")
    return SamSegmenter(model, device)


def _answer(logits: NDArray[np.float32], scores: NDArray[np.float32]) -> Answer:
    """The masks of logits [M, H, W]."""
    strict = np.count_nonzero(logits > _STABILITY_OFFSET, axis=(1, 2))
    lax = np.count_nonzero(logits > -_STABILITY_OFFSET, axis=(1, 2))
    return Answer(logits > 0, scores.astype(float), strict / np.maximum(lax, 1))
