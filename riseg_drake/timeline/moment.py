"""All that is known of one frame, as it goes on the time line."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.pushing.push import NO_PUSH, Push
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.segmentation import Segmentation


@dataclass(frozen=True)
class Moment:
    """Alg. 2 after one frame, and what the arm is about to do."""

    pair: FramePair
    """Its `current` is I_t."""
    expected_flow: NDArray[np.float32]
    """E_t [H, W, 2], pixels."""
    optical_flow: NDArray[np.float32]
    """O_t [H, W, 2], pixels."""
    groups: BFIFGroups
    segmentation: Segmentation
    """L_t."""
    position: NDArray[np.float64] | None = None
    """Joint angles theta_t [n], rad; None where nobody knows them."""
    push: Push = NO_PUSH
    """The one that is under way."""
    stage_ms: Mapping[str, float] = field(default_factory=dict)
    """How long each stage worked on this frame, ms."""
    scores: Mapping[str, float] = field(default_factory=dict)
    """By the name of a figure, percent, where the truth is known."""
