"""`riseg bench --raft`: what RAFT costs on this machine. Weights do not change that, so none are needed."""

from pathlib import Path
from time import perf_counter

import numpy as np
from rich.console import Console

from riseg_drake.app.output import stage_figures
from riseg_drake.app.scenario import load_scenario
from riseg_drake.app.tables import stage_table
from riseg_drake.learned.model_error import require, torch_device
from riseg_drake.learned.raft_flow import RaftFlow

REPETITIONS = 10


def raft_bench_command(scenario_file: Path | None, console: Console) -> None:
    """Time both networks on an image pair of the scenario's camera, on the device that it names."""
    scenario = load_scenario(scenario_file)
    torch = require("torch", extra="raft")
    from riseg_drake.learned.raft import Raft
    from riseg_drake.learned.raft_checkpoint import SIZES

    camera, chosen = scenario.station.camera.intrinsics, scenario.optical_flow.raft
    device = torch_device(chosen.device)
    rng = np.random.default_rng(0)
    images = rng.integers(0, 256, (2, camera.height, camera.width, 3)).astype(np.uint8)
    seconds: dict[str, list[float]] = {}
    with console.status("measuring time"):
        for name, size in SIZES.items():
            flow = RaftFlow(Raft(size).requires_grad_(False), device, chosen.iterations)
            flow(*images)  # the first call prepares memory and kernels
            seconds[name] = []
            for _ in range(REPETITIONS):
                start = perf_counter()
                flow(*images)  # its answer is an array on the CPU, so the GPU is done
                seconds[name].append(perf_counter() - start)
    where = (
        torch.cuda.get_device_name() if device.startswith("cuda") else f"{torch.get_num_threads()} CPU threads"
    )
    title = f"RAFT, one {camera.width}x{camera.height} pair, {chosen.iterations} iterations, {where}"
    console.print(stage_table(stage_figures(seconds), title))
