"""RAFT as a flow method (Alg. 2, line 2): what the paper itself uses. Imports torch only when it is made."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from riseg_drake.learned.model_error import ModelError, require, torch_device

if TYPE_CHECKING:
    from torch import Tensor

    from riseg_drake.learned.raft import Raft


@dataclass
class RaftFlowParameters:
    """RAFT with weights from a file; docs/learned.md says where they come from."""

    checkpoint: str = ""
    """File of a small or a large network, spelled as princeton-vl or torchvision do."""
    iterations: int = 12
    """Corrections of the flow (paper of RAFT: 12 in training, 32 for its tables)."""
    device: str = "auto"
    """"auto" (the GPU if there is one), "cpu", "cuda", "cuda:1" ..."""


class RaftFlow:
    """`FlowMethod` by a RAFT network: full precision on the CPU, half on the GPU."""

    def __init__(self, network: "Raft", device: str = "auto", iterations: int = 12) -> None:
        """Prepare a network; ModelError for a device that is not there, or no iterations."""
        if iterations < 1:
            raise ModelError(f"RAFT needs at least 1 iteration, not {iterations}")
        self._device = torch_device(device)
        self._network, self._iterations = network.eval().to(self._device), iterations

    def __call__(self, color_0: NDArray[np.uint8], color_1: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Flow O_t [H, W, 2], pixels, for RGB images [H, W, 3] of any size."""
        import torch

        height, width = color_0.shape[:2]
        image_0, image_1 = (to_image_tensor(pad(color)).to(self._device) for color in (color_0, color_1))
        half = torch.autocast("cuda", torch.float16, enabled=self._device.startswith("cuda"))
        with torch.inference_mode(), half:
            (flow,) = self._network(image_0, image_1, self._iterations)
        left, top = margins(width)[0], margins(height)[0]
        flow = flow[0, :, top : top + height, left : left + width].float()
        return np.ascontiguousarray(flow.permute(1, 2, 0).cpu().numpy())


def load_raft_flow(parameters: RaftFlowParameters) -> RaftFlow:
    """The method that a scenario describes. Raises ModelError: no torch, no file, not RAFT, no device."""
    require("torch", extra="raft")
    from riseg_drake.learned.raft_checkpoint import load_raft

    if not parameters.checkpoint:
        raise ModelError("RAFT needs weights: name their file in optical_flow.raft.checkpoint")
    return RaftFlow(load_raft(Path(parameters.checkpoint)), parameters.device, parameters.iterations)


def to_image_tensor(color: NDArray[np.uint8]) -> "Tensor":
    """[1, 3, H, W] in [-1, 1] of an RGB image [H, W, 3], as the network wants it."""
    import torch

    image = torch.from_numpy(np.array(color, np.float32)).permute(2, 0, 1)[None]
    return image / 127.5 - 1.0


def pad(color: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """An image [H, W, 3] repeated beyond its edges until it has a size that the network takes."""
    return np.pad(color, (margins(color.shape[0]), margins(color.shape[1]), (0, 0)), mode="edge")


def margins(length: int) -> tuple[int, int]:
    """Pixels to add before and after a side of so many, to reach a multiple of 8, and 128 at least.

    As `Raft` wants it: eight pixels make one of its features, and sixteen features fill its pyramid.
    """
    missing = max(128, -(-length // 8) * 8) - length
    return missing // 2, missing - missing // 2
