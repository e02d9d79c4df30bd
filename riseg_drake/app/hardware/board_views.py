"""Views of a board as they are taken: the arm is moved by hand, and pictures are kept with its joint angles."""

import json
from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep

import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from riseg_drake.app.hardware.drivers import HardwareError, listening, wait_for_drivers
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording import layout
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.whole_file import GrowingText, write_png, write_text
from riseg_drake.robot.calibration_board import FEWEST, CalibrationBoard
from riseg_drake.stations.hardware import HardwareStationConfig, Sight, newest_sight

STILL = 0.01
"""rad/s of every joint below which the arm stands still enough for a view."""
_PATIENCE = 5.0
"""s until a picture must have come."""

Look = Callable[[], tuple[float, NDArray[np.uint8], NDArray[np.float64], float]]
"""The newest picture: time, s; RGB [H, W, 3]; joint angles [7], rad; the fastest joint's speed, rad/s."""


def record_live(config: HardwareStationConfig, board: CalibrationBoard, folder: Path, console: Console) -> None:
    """Take views through the drivers until the person ends it; nothing moves by itself.

    Raises HardwareError where arm or camera are not there, RecordingError for a folder that is not new.
    """
    with listening(config, replayed=False, truth=False) as (reception, _):
        with console.status("waiting for arm and camera") as status:
            wait_for_drivers(reception, config, say=status.update)

        def look() -> tuple[float, NDArray[np.uint8], NDArray[np.float64], float]:
            asked, sight = reception.clock(), None
            deadline = monotonic() + _PATIENCE
            while sight is None:
                if monotonic() > deadline:
                    raise HardwareError(f"no picture with the arm's pose came within {_PATIENCE:g} s")
                sleep(0.02)
                sight = newest_sight(reception, config.camera, after=asked)
            return _of(sight)

        console.print(
            "move the arm by hand so that the camera sees the board from several sides, tilted by 20 degrees "
            "and more; let go, and press Enter for a view; q ends it"
        )
        record_views(
            look, lambda: console.input("view? ").strip().lower() != "q", board, folder, config, console
        )


def record_views(
    look: Look,
    goes_on: Callable[[], bool],
    board: CalibrationBoard,
    folder: Path,
    config: HardwareStationConfig,
    console: Console,
) -> None:
    """Write views that show the board, of an arm that stands still, for as long as it goes on.

    Raises RecordingError for a folder that is not new.
    """
    if folder.exists() and any(folder.iterdir()):
        raise RecordingError(f"{folder} is not empty; give a new folder")
    (folder / layout.COLOR_FOLDER).mkdir(parents=True, exist_ok=True)
    k: Intrinsics = config.camera.intrinsics
    write_text(folder / layout.CAMERA_FILE, json.dumps(layout.camera_to_json(k, layout.MILLIMETRES)))
    images, joints = GrowingText(folder / layout.COLOR_LIST), GrowingText(folder / layout.JOINT_LIST)
    images.append(layout.HEADERS[layout.COLOR_LIST])
    joints.append(layout.HEADERS[layout.JOINT_LIST])
    number = 0
    while goes_on():
        time, color, q, speed = look()
        seen = len(board.corners(cv2.cvtColor(color, cv2.COLOR_RGB2GRAY))[1])
        if speed > STILL or seen < FEWEST:
            why = f"{seen} corners are seen" if seen < FEWEST else f"the arm moves by {speed:.2f} rad/s"
            console.print(f"not taken: {why}", style="yellow", highlight=False)
            continue
        name = f"{layout.COLOR_FOLDER}/{number:06d}.png"
        write_png(folder / name, color)
        images.append(f"{time!r} {name}")
        joints.append(",".join(repr(float(value)) for value in (time, *q)))
        number += 1
        console.print(f"view {number}: {seen} corners", highlight=False)
    images.close()
    joints.close()


def _of(sight: Sight) -> tuple[float, NDArray[np.uint8], NDArray[np.float64], float]:
    color = sight.color.data[..., :3].copy()
    return sight.time, color, sight.position, float(np.abs(sight.velocity).max())
