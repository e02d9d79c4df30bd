"""`riseg drive-camera`: a process of its own between librealsense and LCM, on which `riseg hardware` hears."""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from itertools import count
from pathlib import Path
from time import sleep, time

import numpy as np
from numpy.typing import NDArray
from pydrake.lcm import DrakeLcmInterface
from rich.console import Console

from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.bag_file import SUFFIXES
from riseg_drake.recording.bag_reader import BagReader
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.registration import Registration
from riseg_drake.recording.source import SourceOptions
from riseg_drake.stations.hardware import HardwareCameraConfig
from riseg_drake.stations.lcm_channels import LcmConfig, open_lcm, receive_buffer_warning
from riseg_drake.stations.lcm_images import encode_images
from riseg_drake.stations.realsense import LibrealsenseAlignment, RealSenseCamera, Shot, opened_camera

ANY = LcmConfig.camera_serial
"""The serial number of a scenario that names no camera."""
_SAME = 0.5
"""Pixels by which intrinsics may differ from the camera's own: they move masks by less than that."""


@dataclass(frozen=True)
class RegisteredByLibrealsense(Registration):
    """Depth is aligned as a camera's driver does it."""

    align: Callable[[NDArray[np.float32]], NDArray[np.float32]] | None = None

    def registered_depth(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Depth [H, W], m, 0 = invalid, for the pixels of the colour image."""
        assert self.align is not None
        return self.color.undistorted(self.align(depth), nearest=True)


class Film:
    """A recorded file in the place of a camera; every pair of images comes, as fast as it is asked for.

    Raises RecordingError for what is no bag or RealSense file, RealSenseError where librealsense is missing and
    depth is to be aligned.
    """

    lacking: tuple[str, ...] = ()

    def __init__(self, path: Path):
        if path.suffix not in SUFFIXES or not path.is_file():
            is_no = "no file with" if path.exists() else "not there; expected a file with"
            raise RecordingError(f"{path} is {is_no} {' or '.join(SUFFIXES)}")
        self._reader = BagReader(path, SourceOptions())
        self.name, self.serial = path.name, ""
        if (found := self._reader.registration).depth is not None:
            assert found.X_CD is not None
            align = LibrealsenseAlignment(found.color, found.depth, found.X_CD, 1 / self._reader.depth_scale)
            self._reader.registration = RegisteredByLibrealsense(found.color, found.depth, found.X_CD, align)

    @property
    def intrinsics(self) -> Intrinsics:
        """Of its pictures."""
        return self._reader.intrinsics

    def shots(self) -> Iterator[Shot]:
        """To the end of the file."""
        for frame in self._reader:
            yield Shot(frame.color, frame.depth, frame.time, by_wall=True)

    def end(self) -> str:
        """What is to be said at the end: images that were left out."""
        return "".join(f"; {line}" for line in self._reader.left_out[:1])


def drive_camera_command(scenario_file: Path | None, file: Path | None, console: Console) -> None:
    """Publish pictures until Ctrl-C, or to the end of a file. Raises RealSenseError and RecordingError."""
    scenario = load_scenario(scenario_file, HARDWARE)
    config = scenario.hardware
    named = None if config.lcm.camera_serial == ANY else config.lcm.camera_serial
    size = (config.camera.full_width, config.camera.full_height)
    camera: Film | RealSenseCamera = (
        opened_camera(named, size, config.camera.driver) if file is None else Film(file)
    )
    serial = named or camera.serial or ANY
    channel = LcmConfig(camera_serial=serial).image_channel
    console.print(f"{camera.name or 'camera'}: {channel} on {config.lcm.url}", highlight=False, soft_wrap=True)
    if serial != config.lcm.camera_serial:
        console.print(f"the scenario wants `camera_serial: {serial!r}` in station.lcm", style="yellow")
    if camera.lacking:
        console.print(f"this camera has no {', '.join(camera.lacking)}", style="yellow")
    for line in unlike(config.camera, camera.intrinsics):
        console.print(line, style="yellow", highlight=False)
    console.print(scenario_lines(camera.intrinsics), markup=False, highlight=False)
    if warning := receive_buffer_warning(config.lcm.url):
        console.print(warning, style="yellow")
    published, begun = 0, time()
    try:
        for published in publish(  # noqa: B007
            on_the_wall(camera.shots(), isinstance(camera, Film)), open_lcm(config.lcm), channel
        ):
            pass
    finally:
        seconds = max(time() - begun, 1e-3)
        left_out = camera.end() if isinstance(camera, Film) else ""
        console.print(
            f"{published} pictures in {seconds:.0f} s, {published / seconds:.1f} a second{left_out}",
            highlight=False,
        )


def scenario_lines(k: Intrinsics) -> str:
    """A colour camera as a scenario wants it."""
    return (
        "station: !HardwareStationConfig\n"
        "  camera:\n"
        f"    full_width: {k.width}\n"
        f"    full_height: {k.height}\n"
        f"    fx: {k.fx:.3f}\n"
        f"    fy: {k.fy:.3f}\n"
        f"    cx: {k.cx:.3f}\n"
        f"    cy: {k.cy:.3f}"
    )


def unlike(config: HardwareCameraConfig, k: Intrinsics) -> list[str]:
    """What a scenario has otherwise than the camera, a line each."""
    real = {"full_width": k.width, "full_height": k.height, **asdict(k)}
    return [
        f"the scenario has {key}: {getattr(config, key):g}, the camera {real[key]:g}; take the lines below"
        for key in ("full_width", "full_height", "fx", "fy", "cx", "cy")
        if abs(getattr(config, key) - real[key]) > _SAME
    ]


def on_the_wall(
    shots: Iterator[Shot],
    film: bool,
    clock: Callable[[], float] = time,
    wait: Callable[[float], None] = sleep,
) -> Iterator[tuple[float, Shot]]:
    """Shots with the time, s, by the computer's clock, at which they were taken.

    Those of a film are taken now, one after the other at the pace in which they were; a camera whose clock is
    its own is believed to be without delay.
    """
    start: float | None = None
    for shot in shots:
        if film:
            start = clock() - shot.time if start is None else start
            wait(max(0.0, start + shot.time - clock()))
            yield start + shot.time, shot
        else:
            yield (shot.time if shot.by_wall else clock()), shot


def publish(
    shots: Iterator[tuple[float, Shot]],
    lcm: DrakeLcmInterface,
    channel: str,
    clock: Callable[[], float] = time,
) -> Iterator[int]:
    """Send each shot as the RealSense driver does, and say how many were sent."""
    for number, (taken, shot) in zip(count(1), shots, strict=False):
        message = encode_images(shot.color, shot.depth, taken, max(clock(), taken), number)
        lcm.Publish(channel, message.encode())
        yield number
