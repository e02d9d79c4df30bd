"""Whether the drivers of arm and camera are there, and what a person does where they are not."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from drake import lcmt_panda_status

from riseg_drake.app.run.interactions import TruthSource
from riseg_drake.app.run.truth_reception import TruthReception
from riseg_drake.robot.supervisor import MOVE
from riseg_drake.stations.hardware import HardwareStationConfig
from riseg_drake.stations.lcm_channels import ARM_DRIVERS, CAMERA_DRIVERS, open_lcm
from riseg_drake.stations.lcm_images import ImageError, decode_images
from riseg_drake.stations.lcm_reception import Reception

PATIENCE = 20.0
"""Arm and camera must have been heard after this time, s."""
ENDED = 1.0
"""The arm's status has ended when the newest is older than this, s."""


class HardwareError(RuntimeError):
    """Arm or camera are not there; says in one line what is missing."""


_MODES = {
    lcmt_panda_status.kOther: f"other: start {ARM_DRIVERS} again",
    lcmt_panda_status.kIdle: "idle: start `riseg drive-arm`, or drake-franka-driver with "
    "--control_mode=position or velocity",
    lcmt_panda_status.kGuiding: "guided by hand: let go of the guiding buttons",
    lcmt_panda_status.kReflex: f"reflex: unlock the robot in Desk and start {ARM_DRIVERS} again",
    lcmt_panda_status.kUserStopped: f"user stopped: release the user stop and start {ARM_DRIVERS} again",
    lcmt_panda_status.kAutomaticErrorRecovery: "recovering from an error",
}
"""What a person does about each `robot_mode` in which the arm takes no commands."""


@contextmanager
def listening(
    config: HardwareStationConfig, replayed: bool, truth: bool
) -> Iterator[tuple[Reception, TruthSource]]:
    """Hear arm and camera, and the emulator's truth if asked, for the time of a `with`."""
    lcm = open_lcm(config.lcm)
    reception = Reception(lcm, config.lcm, replayed)
    source: TruthSource = lambda frame, context: None  # noqa: E731
    if truth:
        source = TruthReception(lcm, config.camera.first_column, lambda: reception.offset)
    reception.start()
    try:
        yield reception, source
    finally:
        reception.stop()


def wait_for_drivers(
    reception: Reception,
    config: HardwareStationConfig,
    patience: float = PATIENCE,
    *,
    ready: bool = False,
    say: Callable[[str], None] = lambda text: None,
) -> None:
    """Return when both have been heard, and, where it must be `ready`, the arm takes commands.

    `say` is told what is waited for. Raises HardwareError after `patience`, s, and ImageError where no picture
    is of the right kind.
    """
    deadline = time.monotonic() + patience
    while problem := _what_is_missing(reception, config, ready):
        say(f"waiting: {problem}")
        if time.monotonic() >= deadline:
            left_out = "".join(f"; {line}" for line in reception.untold())
            raise HardwareError(f"{problem} within {patience:g} s at {config.lcm.url}{left_out}")
        time.sleep(0.02)


def with_reasons(line: str, reception: Reception) -> str:
    """A line on why the arm does not move, with what its driver says about that, where it says something."""
    return f"{line}; its driver says: {reception.driver_says}" if reception.driver_says else line


def _what_is_missing(reception: Reception, config: HardwareStationConfig, ready: bool) -> str:
    """What keeps a run from beginning; empty if nothing does. Raises ImageError."""
    silent = []
    if reception.status is None:
        silent.append(f"{config.lcm.status_channel} (is {ARM_DRIVERS} running?)")
    if not reception.pictures:
        silent.append(f"{config.lcm.image_channel} (is {CAMERA_DRIVERS} running, with that serial?)")
    if silent:
        return f"nothing came on {' nor on '.join(silent)}"
    status = reception.status
    assert status is not None
    if ready and reception.clock() - status.time > ENDED:
        return f"{config.lcm.status_channel} has ended (start {ARM_DRIVERS} again), and nothing more came"
    if ready and status.robot_mode != MOVE:
        why = with_reasons(_MODES[status.robot_mode], reception)
        return f"robot_mode is {status.robot_mode} ({why}), and did not change"
    newest = reception.newest_picture(after=-np.inf)
    if newest is None:
        return "no picture came that can be used"
    sent, message = newest
    try:
        decode_images(message, (config.camera.full_width, config.camera.full_height))
    except ImageError as error:
        reception.skip(sent, error)
        return "no picture came that can be used"
    reception.used()
    return ""
