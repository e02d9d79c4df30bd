"""`riseg bench --stream`: does the stream of commands stay even while segmentation takes all it can get?"""

import threading
import time

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from riseg_drake.app.bench.command import segment_once
from riseg_drake.app.bench.recorded_push import StationOutputs
from riseg_drake.app.scenario import Scenario
from riseg_drake.robot.command_stream import CommandParameters
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import READY
from riseg_drake.stations.command_process import CommandProcess
from riseg_drake.stations.hardware import TARGET_PERIOD
from riseg_drake.stations.ideal_arm import IdealArm
from riseg_drake.stations.lcm_channels import LcmConfig

URL = "udpm://239.255.76.67:7699?ttl=0"
"""A network of its own, so that no arm hears it."""
STATUS_PERIOD = 0.005
MOST_GAP, LONGEST_GAP = 0.02, 0.05
"""99.9 % of the gaps must be at most the one, all at most the other, s: half the time after which the driver
takes a command for expired."""


def bench_stream(scenario: Scenario, images: list[StationOutputs], seconds: float, console: Console) -> None:
    """Send commands for some seconds from their own process, beside Alg. 2 on the images without a pause."""
    parameters = CommandParameters()
    lcm = LcmConfig(url=URL)
    stopping = threading.Event()
    with CommandProcess(lcm, parameters, PandaDescription()) as commands:
        feeder = threading.Thread(target=_feed, args=(lcm, commands, stopping), daemon=True)
        feeder.start()
        end, rounds = time.monotonic() + seconds, 0
        while time.monotonic() < end:
            segment_once(scenario, images)
            rounds += 1
        stopping.set()
        feeder.join()
    gaps = np.diff(commands.send_times)
    words = "good" if is_even(gaps, 1 / parameters.rate) else "NOT good enough"
    console.print(
        f"{len(gaps)} gaps between commands in {seconds:g} s, beside {rounds * (len(images) - 1)} image pairs: "
        f"median {1e3 * np.median(gaps):.2f} ms, 99.9 % at most {1e3 * np.percentile(gaps, 99.9):.2f} ms, "
        f"longest {1e3 * gaps.max():.2f} ms: {words}"
    )


def is_even(gaps: NDArray, period: float) -> bool:
    """Whether a real arm would be content with gaps [N], s, where one of `period`, s, is meant."""
    return bool(
        abs(np.median(gaps) - period) <= 0.1 * period
        and np.percentile(gaps, 99.9) <= MOST_GAP
        and gaps.max() <= LONGEST_GAP
    )


def _feed(config: LcmConfig, commands: CommandProcess, stopping: threading.Event) -> None:
    """An arm that stands still, and targets for it."""
    arm, target = IdealArm(config), 0.0
    while not stopping.wait(STATUS_PERIOD):
        arm.speak()
        now = time.time()
        if now - target >= TARGET_PERIOD:
            commands.send_target(now, READY)
            target = now
