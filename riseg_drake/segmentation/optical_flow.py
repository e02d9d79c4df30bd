"""Alg. 2, line 2: the flow that the images themselves show.

Any method serves that follows the protocol `FlowMethod`; the paper uses RAFT and says that any other
may stand in. Dense inverse search (DIS, OpenCV) is the default here: it needs no weights and no GPU.
"""

from dataclasses import dataclass, field
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

DIS_PRESETS = {
    "ultrafast": cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST,
    "fast": cv2.DISOPTICAL_FLOW_PRESET_FAST,
    "medium": cv2.DISOPTICAL_FLOW_PRESET_MEDIUM,
}


class FlowMethod(Protocol):
    """What a flow method must do."""

    def __call__(self, color_0: NDArray[np.uint8], color_1: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Flow O_t [H, W, 2] in pixels from image 0 to image 1, both [H, W, 3] RGB."""
        ...


@dataclass
class DisFlowParameters:
    """Dense inverse search (Kroeger et al. 2016), as OpenCV has it."""

    preset: str = field(default="medium", metadata={"choices": tuple(DIS_PRESETS)})
    """"ultrafast", "fast" or "medium": 2, 3 and 14 ms at 640x480 on two cores."""


class DisFlow:
    """`FlowMethod` by OpenCV's dense inverse search on gray images. Deterministic."""

    def __init__(self, parameters: DisFlowParameters | None = None) -> None:
        """Prepare the method; ValueError for an unknown preset."""
        preset = (parameters or DisFlowParameters()).preset
        if preset not in DIS_PRESETS:
            raise ValueError(f"no DIS preset {preset!r}: choose one of {', '.join(DIS_PRESETS)}")
        self._dis = cv2.DISOpticalFlow_create(DIS_PRESETS[preset])

    def __call__(self, color_0: NDArray[np.uint8], color_1: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Flow O_t [H, W, 2], pixels."""
        gray_0, gray_1 = (cv2.cvtColor(c, cv2.COLOR_RGB2GRAY) for c in (color_0, color_1))
        return self._dis.calc(gray_0, gray_1, None)
