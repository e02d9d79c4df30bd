"""`riseg bench --stops`: how soon a moving arm stands still after each cause to stop, over LCM."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from drake import lcmt_panda_status
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from riseg_drake.robot.command_stream import CommandParameters
from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import RobotLimits
from riseg_drake.robot.target_playout import PlayoutParameters
from riseg_drake.stations.command_process import CommandProcess
from riseg_drake.stations.hardware import TARGET_PERIOD
from riseg_drake.stations.ideal_arm import IdealArm
from riseg_drake.stations.lcm_channels import LcmConfig

URL = "udpm://239.255.76.67:7698?ttl=0"
"""A network of its own, so that no arm hears it."""
STATUS_PERIOD, IMAGE_PERIOD = 0.005, 1 / 15
SWINGING, NEARLY = [0, 4, 6], 0.95
"""Joints that swing, to both sides of a middle, and their greatest speed as a share of that of commands."""
SWING_TIME = 3.0
"""There and back, s."""
BEFORE = 1.25 * SWING_TIME + PlayoutParameters().delay
"""s of motion before the cause: the joints are at their fastest then."""
AFTER = 1.2
"""s of watching after the cause."""
LONGEST = 0.3
"""s; a stop must not take longer."""
JUST_NOW = 0.1
"""s; an arm that did not move so short before a cause had stopped for another."""


class NoMotionError(RuntimeError):
    """An arm that stood still shows no stop."""


@dataclass
class _World:
    """What a cause can change."""

    arm: IdealArm
    commands: CommandProcess
    swing: NDArray[np.float64]
    """How far the joints swing to each side, rad [7]."""
    start: float
    """Wall time, s, at which the arm begins to swing."""
    speaks: bool = True
    shows: bool = True
    plans: bool = True


@dataclass(frozen=True)
class Stop:
    """How one stop went."""

    seconds: float
    """From the cause until commands are zero."""
    acceleration: float
    """Largest share of what is allowed in a stop."""


def bench_stops(console: Console) -> None:
    """Try every cause on an arm that swings, and print a table."""
    safety = CommandParameters().safety
    causes: dict[str, tuple[Callable[[_World], None], float]] = {
        "reflex": (lambda world: setattr(world.arm, "mode", lcmt_panda_status.kReflex), 0.0),
        "user stop": (lambda world: setattr(world.arm, "mode", lcmt_panda_status.kUserStopped), 0.0),
        "force at the tip": (lambda world: setattr(world.arm, "torque_external", np.full(7, 20.0)), 0.0),
        "no more status": (lambda world: setattr(world, "speaks", False), safety.status_age),
        "no more pictures": (lambda world: setattr(world, "shows", False), safety.image_age),
        "the program ends": (_end, 0.0),
    }
    table = Table("cause", "until it stands still, s", "acceleration, share of the limit")
    good = True
    for name, (happen, patience) in causes.items():
        try:
            with console.status(f"stopping a moving arm: {name}"):
                stop = measure_stop(happen, patience)
        except NoMotionError as error:
            table.add_row(name, str(error), "")
            good = False
            continue
        table.add_row(name, f"{stop.seconds:.3f}", f"{stop.acceleration:.2f}")
        good = good and stop.seconds <= LONGEST and stop.acceleration <= 1.01
    console.print(table)
    console.print(
        f"news that does not come is a cause once it is {safety.status_age:g} s (status) or "
        f"{safety.image_age:g} s (pictures) old; all within {LONGEST:g} s and the limits: "
        f"{'yes' if good else 'NO'}"
    )


def measure_stop(happen: Callable[[_World], None], patience: float) -> Stop:
    """Let an arm swing, let something happen, and watch the commands; `patience` s pass before it counts."""
    config, parameters, panda = LcmConfig(url=URL), CommandParameters(), PandaDescription()
    swing = np.zeros(7)
    fastest = NEARLY * parameters.limits.velocity * panda.limits.velocity
    swing[SWINGING] = fastest[SWINGING] * SWING_TIME / (2 * np.pi)
    with CommandProcess(config, parameters, panda) as commands:
        world = _World(IdealArm(config), commands, swing, time.time())
        _live(world, BEFORE)
        cause = time.time()
        happen(world)
        _live(world, AFTER + patience)
    return judged(world.arm.commands, cause + patience, parameters, panda.limits)


def judged(
    commands: list[tuple[float, NDArray[np.float64]]],
    cause: float,
    parameters: CommandParameters,
    robot: RobotLimits,
) -> Stop:
    """The stop in a list of commands (stamp in s, velocities in rad/s [7]), for a cause at a wall time, s.

    Raises NoMotionError where the arm did not move up to then.
    """
    period = 1 / parameters.rate
    stamps = np.array([stamp for stamp, _ in commands])
    velocity = np.array([values for _, values in commands])
    moving = stamps[np.abs(velocity).max(axis=1) > 1e-6]
    if not ((cause - JUST_NOW < moving) & (moving < cause)).any():
        raise NoMotionError("it did not move until then; is the computer busy?")
    steps = np.maximum(np.rint(np.diff(stamps) / period), 1)[:, None] * period
    acceleration = np.abs(np.diff(velocity, axis=0)) / steps
    allowed = parameters.limits.stop_acceleration * robot.acceleration
    return Stop(max(float(moving[-1]) - cause, 0.0), float((acceleration / allowed).max()))


def _live(world: _World, seconds: float) -> None:
    """Status, pictures and targets for some time."""
    now = time.time()
    end, target, picture = now + seconds, 0.0, 0.0
    while now < end:
        if world.speaks:
            world.arm.speak()
        if world.shows and now - picture >= IMAGE_PERIOD:
            world.arm.show()
            picture = now
        if world.plans and now - target >= TARGET_PERIOD:
            phase = 2 * np.pi * (now - world.start) / SWING_TIME
            world.commands.send_target(now, READY + world.swing * (1 - np.cos(phase)))
            target = now
        time.sleep(STATUS_PERIOD)
        world.arm.listen()
        now = time.time()


def _end(world: _World) -> None:
    world.plans = False
    threading.Thread(target=world.commands.close, daemon=True).start()
