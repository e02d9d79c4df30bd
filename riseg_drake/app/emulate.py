"""`riseg emulate`: the drivers of arm and camera, each in a process of its own, around one simulated world.

Drawing a picture takes tens of milliseconds, and the arm's status is due every single one: so the arm's
process does the physics and sends the camera's process where everything is, at the camera's rate.
"""

import gc
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from time import sleep, time

from rich.console import Console

from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output_folder import to_json, write_told
from riseg_drake.app.scenario import load_scenario, scenario_name
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.host.processes import deaf_children, end_with_parent
from riseg_drake.stations.emulated_arm import TICK_US, EmulatedArm
from riseg_drake.stations.emulated_camera import EmulatedCamera
from riseg_drake.stations.emulated_drivers import CameraSide, EmulatorConfig, Moment, PandaSide
from riseg_drake.stations.lcm_channels import LcmConfig, open_lcm, receive_buffer_warning
from riseg_drake.stations.misbehaviour import CONTROL_CHANNEL, WORDS, WordError, parse_word
from riseg_drake.stations.motion_judge import MotionVerdict
from riseg_drake.stations.promptness import be_prompt
from riseg_drake.stations.simulated import SimulatedStationConfig

_GIVE_WAY = 2  # niceness of the camera's process: the status comes first, but pictures must not starve
_PRIORITY = 10  # of the arm's process among real-time ones, where the system allows that
_LONGEST_WAIT = 0.05  # s, until the camera's process listens for words again


def emulate_command(
    scenario_file: Path | None,
    seed: int,
    control_mode: str | None,
    faults: Sequence[str],
    say: str | None,
    judge: Path | None,
    console: Console,
) -> None:
    """Behave as the drivers do until Ctrl-C; or, with `say`, tell a running emulator a word.

    How calm the arm's motion was is said at the end, and written to `judge` as JSON. Raises ScenarioError for a
    scene or settings that cannot be, WordError for an unknown word, OutputError where nothing can be written.
    """
    scenario = load_scenario(scenario_file)
    config = scenario.emulator
    for word in [*faults, *([say] if say else [])]:
        parse_word(word)
    if say:
        open_lcm(config.lcm).Publish(CONTROL_CHANNEL, say.encode())
        return
    station = scenario.simulated
    if judge:
        write_verdict(judge, MotionVerdict())  # so that a file that cannot be written is noticed now
    require_graphics()
    if control_mode:
        config.driver.control_mode = control_mode
    warning = receive_buffer_warning(config.lcm.url)
    if warning:
        console.print(warning, style="yellow")
    with _camera_process(scenario_file, seed, faults) as camera:
        with console.status("placing the objects"):
            arm = _place(station, config, seed)
            with _camera_lives():
                complaint = camera.recv()
        if complaint:
            raise ScenarioError(complaint)
        console.print(
            f"{scenario_name(scenario_file)}, seed {seed}: {config.lcm.status_channel} and "
            f"{config.lcm.image_channel} on {config.lcm.url}, --control_mode={config.driver.control_mode}; "
            "Ctrl-C ends it"
        )
        _run(PandaSide(open_lcm(config.lcm), config, arm, seed, faults), config, camera, console)
        verdict = arm.driver.judge.verdict()
        if verdict.seconds:
            console.print(f"the arm {verdict}")
        if judge:
            write_verdict(judge, verdict)


class CameraDiedError(RuntimeError):
    """The emulator has no camera any more; in one line."""


def write_verdict(file: Path, verdict: MotionVerdict) -> None:
    """How calm the arm's motion was, as JSON. Raises OutputError."""
    write_told(file, to_json(asdict(verdict)).encode(), make_folder=True)


def _place(station: SimulatedStationConfig, config: EmulatorConfig, seed: int) -> EmulatedArm:
    try:
        return EmulatedArm(station, config.driver, seed, _wall_us())
    except (ValueError, RuntimeError) as error:
        raise ScenarioError(" ".join(str(error).split())) from error


def _run(side: PandaSide, config: EmulatorConfig, camera: Connection, console: Console) -> None:
    """Keep time until Ctrl-C, and say then what rates were reached."""
    if _may_read_terminal():
        if sys.stdin.isatty():
            console.print(f"you may type: {WORDS}")
        threading.Thread(target=_pass_on, args=(config.lcm, console), daemon=True).start()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a shell's background programs hear no Ctrl-C
    be_prompt(_PRIORITY)  # as the real arm, which has a computer of its own
    start = time()
    try:
        with _camera_lives():
            _keep_time(side, camera, 1 / config.rate, console)
    except KeyboardInterrupt:
        elapsed = time() - start
        with _camera_lives():
            camera.send(None)
            pictures = camera.recv()
        console.print(
            f"ended after {elapsed:.0f} s: status at {side.published / elapsed:.0f} Hz, "
            f"pictures at {pictures / elapsed:.1f} Hz"
        )


def _keep_time(side: PandaSide, camera: Connection, period: float, console: Console) -> None:
    """Keep the arm's world at wall time, and have it drawn every `period` s."""
    arm = side.arm
    next_picture = 0
    while True:
        side.advance(_wall_us())
        for note in side.notes():
            console.print(note)
        if arm.state_us >= next_picture or arm.state_us < next_picture - int(1e6 * period):  # the clock was set
            # Late pictures do not bring the next one nearer.
            in_time = min(next_picture, arm.state_us) + int(1e6 * period)
            next_picture = max(in_time, arm.state_us + int(0.5e6 * period))
            camera.send(Moment(arm.state_us, arm.positions(), not arm.driver.robot.is_moving))
        sleep(max(0.0, 1e-6 * (arm.wall_us + TICK_US - _wall_us())))


@contextmanager
def _camera_lives() -> Iterator[None]:
    """For talk with the camera's process in a `with`. Raises CameraDiedError."""
    try:
        yield
    except (EOFError, BrokenPipeError, ConnectionResetError):
        raise CameraDiedError(
            "the process that draws the camera's pictures has died; it was out of memory, or the renderer broke"
        ) from None


@contextmanager
def _camera_process(scenario_file: Path | None, seed: int, faults: Sequence[str]) -> Iterator[Connection]:
    """The camera's process for the time of a `with`; it first says "", or why it cannot be."""
    spawn = get_context("spawn")
    here, there = spawn.Pipe()
    process = spawn.Process(target=_draw, args=(there, os.getpid(), scenario_file, seed, faults), daemon=True)
    with deaf_children():  # Ctrl-C is this process's to hear
        process.start()
    there.close()
    try:
        yield here
    finally:
        here.close()
        process.join(timeout=5)


def _draw(
    commands: Connection, parent: int, scenario_file: Path | None, seed: int, faults: Sequence[str]
) -> None:
    """The camera's process: draws where everything was said to be, and falls behind rather than late."""
    end_with_parent(parent)
    os.nice(_GIVE_WAY)
    scenario = load_scenario(scenario_file)
    try:
        eye = EmulatedCamera(scenario.simulated, seed)
    except (ValueError, RuntimeError) as error:
        with suppress(BrokenPipeError):
            commands.send(" ".join(str(error).split()))
        return
    side = CameraSide(open_lcm(scenario.emulator.lcm), scenario.emulator, eye, seed, faults)
    gc.collect()
    gc.freeze()
    with suppress(EOFError, BrokenPipeError):  # where the other process is gone
        commands.send("")
        while True:
            wait = side.flush(time()) - time()
            if not commands.poll(max(0.0, min(wait, _LONGEST_WAIT))):
                continue
            moment = commands.recv()
            while moment is not None and commands.poll():
                moment = commands.recv()  # only the newest is worth drawing
            if moment is None:
                break
            side.show(moment, time())
        commands.send(side.published)


def _pass_on(config: LcmConfig, console: Console) -> None:
    """Send what the operator types to both processes; each picks out what is meant for it."""
    lcm = open_lcm(config)
    for line in sys.stdin:
        if line.strip():
            try:
                parse_word(line)
                lcm.Publish(CONTROL_CHANNEL, line.strip().encode())
            except WordError as error:
                console.print(str(error))


def _may_read_terminal() -> bool:
    """Whether the operator can type here; a program in the background is stopped when it tries to read."""
    if sys.stdin is None or sys.stdin.closed:
        return False
    return not sys.stdin.isatty() or os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()


def _wall_us() -> int:
    return int(1e6 * time())
