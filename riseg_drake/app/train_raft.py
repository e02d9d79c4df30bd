"""Trains a small RAFT on drawn rigid motion and says how it does on pairs that it never saw.

python -m riseg_drake.app.train_raft raft_small_drawn.pth
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter, process_time
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.table import Table

from riseg_drake.learned.model_error import ModelError, require
from riseg_drake.learned.raft_flow import RaftFlow
from riseg_drake.learned.rigid_motion_pairs import PairParameters, draw_pair
from riseg_drake.segmentation.optical_flow import DisFlow, FlowMethod

if TYPE_CHECKING:
    from riseg_drake.learned.raft import Raft

TELL_EVERY = 200
"""Steps."""
UNSEEN_PAIRS = 100
_LIKE_TRAINING = PairParameters()
UNSEEN = {
    "as in training": (UNSEEN_PAIRS, _LIKE_TRAINING),
    "640x480": (UNSEEN_PAIRS // 5, replace(_LIKE_TRAINING, width=640, height=480, focal_length=615.0)),
}
"""What the network is tried on: how many pairs, and of what kind."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Train, save, report; 0 when done, 2 on bad input."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("output", type=Path, metavar="FILE", help="the checkpoint to write")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="draws weights and pairs (0)")
    parser.add_argument("--steps", type=int, metavar="N", help="of training (8000)")
    parser.add_argument("--threads", type=int, default=1, metavar="N", help="for torch (1)")
    chosen = parser.parse_args(arguments)
    console = Console()
    try:
        torch = require("torch", extra="raft")
    except ModelError as error:
        parser.error(str(error))
    # Threads that wait for each other lose more than they bring on a machine that does something else, too.
    torch.set_num_threads(chosen.threads)
    from riseg_drake.learned.raft_training import TrainingParameters, save, train

    parameters = TrainingParameters()
    if chosen.steps is not None:
        parameters = replace(parameters, steps=chosen.steps)
    start, recent = perf_counter(), []

    def tell(step: int, error: float, network: "Raft") -> None:
        recent.append(error)
        if step % TELL_EVERY == 0 or step == parameters.steps:
            save(network, chosen.output)  # so far: who stops it has something
            console.print(
                f"step {step} of {parameters.steps}: end-point error {np.mean(recent):.2f} px, "
                f"{perf_counter() - start:.0f} s, {process_time():.0f} s of processor time"
            )
            recent.clear()

    network = train(chosen.seed, parameters, tell)
    console.print(f"{chosen.output} written after {(perf_counter() - start) / 60:.1f} minutes")
    report(RaftFlow(network, device="cpu"), chosen.seed, console)
    return 0


def report(raft: RaftFlow, seed: int, console: Console) -> dict[str, dict[str, tuple[float, float]]]:
    """Print the end-point errors of RAFT, DIS and zero flow on unseen pairs; returns them, pixels.

    By kind of pair and method: over all pixels, and on bodies.
    """
    from riseg_drake.learned.raft_training import end_point_errors

    errors: dict[str, dict[str, tuple[float, float]]] = {}
    table = Table(box=box.SIMPLE, title="mean end-point error on unseen pairs, pixels", title_justify="left")
    for column in ("pairs", "method", "all pixels", "on bodies"):
        table.add_column(column, justify="left" if column in ("pairs", "method") else "right")
    for kind, (count, parameters) in UNSEEN.items():
        rng = np.random.default_rng([seed, 1])  # training has [seed, 0]
        pairs = [draw_pair(rng, parameters) for _ in range(count)]
        methods: dict[str, FlowMethod] = {"RAFT": raft, "DIS": DisFlow(), "zero flow": no_flow}
        errors[kind] = {name: end_point_errors(method, pairs) for name, method in methods.items()}
        for name, (everywhere, on_bodies) in errors[kind].items():
            table.add_row(f"{count} {kind}", name, f"{everywhere:.2f}", f"{on_bodies:.2f}")
    console.print(table)
    return errors


def no_flow(color_0: NDArray[np.uint8], color_1: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Nothing moves, [H, W, 2]."""
    return np.zeros((*color_0.shape[:2], 2), np.float32)


if __name__ == "__main__":
    raise SystemExit(main())
