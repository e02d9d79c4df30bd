"""Trains RAFT small on drawn rigid motion: modest weights, made in minutes, without any public ones.

As in the RAFT paper (section 3.4): L1 distance to the true flow after every iteration, later ones counting
more, AdamW with one cycle of the learning rate, gradients clipped. Convolutions are in bfloat16: a processor
that knows this format takes a fifth less time for a step. Imports torch.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from riseg_drake.learned.raft import RAFT_SMALL, Raft
from riseg_drake.learned.raft_checkpoint import torchvision_names
from riseg_drake.learned.raft_flow import to_image_tensor
from riseg_drake.learned.rigid_motion_pairs import FlowPair, PairParameters, draw_pair


@dataclass
class TrainingParameters:
    """A quarter of an hour on one core."""

    steps: int = 8000
    batch: int = 2
    """Pairs in a step."""
    iterations: int = 5
    """Corrections of the flow in training (paper: 12)."""
    learning_rate: float = 1e-3
    """At its highest (paper: 4e-4, for far longer); learns faster in the few steps there are."""
    weight_decay: float = 1e-5
    """Of AdamW."""
    decay: float = 0.8
    """What an iteration counts against the one after it (paper: 0.8)."""
    gradient_norm: float = 1.0
    """Longer gradients are cut to this (paper: 1)."""
    pairs: PairParameters = field(default_factory=PairParameters)


Tell = Callable[[int, float, Raft], None]
"""Is called after every step with its number, from 1, its end-point error, pixels, and the network so far."""


def train(seed: int, parameters: TrainingParameters, tell: Tell = lambda step, error, network: None) -> Raft:
    """A network trained on pairs drawn from `seed`.

    Args:
        seed: of the first weights and of the pairs; the same gives the same network on the same machine.
        parameters: see there.
        tell: follows how it goes.
    """
    torch.manual_seed(seed)
    rng = np.random.default_rng([seed, 0])
    network = Raft(RAFT_SMALL).train()
    optimizer = torch.optim.AdamW(
        network.parameters(), lr=parameters.learning_rate, weight_decay=parameters.weight_decay, fused=True
    )
    schedule = torch.optim.lr_scheduler.OneCycleLR(  # as the authors' code has it
        optimizer,
        parameters.learning_rate,
        total_steps=parameters.steps + 1,
        pct_start=0.05,
        anneal_strategy="linear",
        cycle_momentum=False,
    )
    for step in range(1, parameters.steps + 1):
        pairs = [draw_pair(rng, parameters.pairs) for _ in range(parameters.batch)]
        image_0, image_1 = (
            torch.cat([to_image_tensor(color) for color in colors])
            for colors in ([p.color_0 for p in pairs], [p.color_1 for p in pairs])
        )
        true_flow = torch.stack([torch.from_numpy(pair.flow).permute(2, 0, 1) for pair in pairs])
        with torch.autocast("cpu", torch.bfloat16):
            flows = network(image_0, image_1, parameters.iterations)
        loss = torch.zeros(())
        for flow in flows:
            loss = parameters.decay * loss + (flow - true_flow).abs().mean()
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), parameters.gradient_norm)
        optimizer.step()
        schedule.step()
        tell(step, float(_end_point_error(flows[-1].detach(), true_flow)), network)
    return network.eval().requires_grad_(False)


def save(network: Raft, path: Path) -> None:
    """Write the weights as torchvision spells them, so that other programs can read them, too.

    The file is the one before or the new one, whenever the program is stopped.
    """
    own = network.state_dict()
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.unfinished")
    torch.save({name: own[key] for name, key in torchvision_names(network.size).items()}, unfinished)
    os.replace(unfinished, path)


Method = Callable[[NDArray[np.uint8], NDArray[np.uint8]], NDArray[np.float32]]


def end_point_errors(method: Method, pairs: Sequence[FlowPair]) -> tuple[float, float]:
    """Mean distance in pixels between a method's flow and the true one: over all pixels, and on bodies."""
    errors = [np.linalg.norm(method(p.color_0, p.color_1) - p.flow, axis=-1) for p in pairs]
    on_bodies = np.concatenate([e[p.on_body] for e, p in zip(errors, pairs, strict=True)])
    return float(np.mean(errors)), float(on_bodies.mean())


def _end_point_error(flow: Tensor, true_flow: Tensor) -> Tensor:
    return (flow - true_flow).norm(dim=1).mean()
