"""`riseg calibrate`: where the camera is, from a folder with views of a board, as the scenario's lines."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pydrake.math import RigidTransform, RollPitchYaw
from rich.console import Console

from riseg_drake.app.hardware.board_views import record_live
from riseg_drake.app.output_folder import write_told
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.geometry.camera import project
from riseg_drake.geometry.se3 import inverse, log_se3
from riseg_drake.host.images import DamagedImageError, read_image
from riseg_drake.recording import layout
from riseg_drake.recording.camera_file import read_camera
from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.source import STAMP_LIMIT
from riseg_drake.recording.stamped_lists import pose_between, read_file_list, read_table, row_between
from riseg_drake.robot.calibration_board import FEWEST, CalibrationBoard
from riseg_drake.robot.camera_calibration import BoardView, CalibrationError, CameraCalibration, calibrated
from riseg_drake.robot.kinematics import PandaKinematics

TIP_LIST = "tip.txt"
"""`timestamp tx ty tz qx qy qz qw`, the tip's pose X_WE, where there are no joint angles."""
SURE = (0.001, 0.0017)
"""Standard errors, m and rad (0.1 degrees), above which more views are advised."""
GOOD = 1.0
"""Pixels; corners further off mean that something is not as it is said to be."""
_DPI = 300
"""Pixels an inch of a board that is drawn."""
_PRINTED = _DPI / 0.0254
"""The same a metre."""


@dataclass(frozen=True)
class CalibrateRequest:
    """What a person asks of `riseg calibrate`."""

    folder: Path | None = None
    scenario: Path | None = None
    board: Sequence[str] = ("charuco", "7x5", "40", "30")
    """Kind, columns and rows, and two lengths, mm."""
    mount: str | None = None
    """None: as the scenario says."""
    live: bool = False
    output: Path | None = None
    draw: Path | None = None


def calibrate_command(request: CalibrateRequest, console: Console) -> None:
    """Calibrate, and tell it. Raises CalibrationError, RecordingError and what a scenario raises."""
    board = board_of(request.board)
    if request.draw is not None:
        png = io.BytesIO()
        Image.fromarray(board.drawn(_PRINTED)).save(png, "png", dpi=(_DPI, _DPI))
        write_told(request.draw, png.getvalue())
        width, height = (1000 * side for side in board.size)
        console.print(
            f"{request.draw}: print it at {_DPI} dpi, {width:.1f} x {height:.1f} mm, and measure it",
            highlight=False,
            soft_wrap=True,
        )
        return
    if request.folder is None:
        raise CalibrationError(
            "name the folder with the views, or a new one and --live; --draw FILE draws a board"
        )
    config = load_scenario(request.scenario, HARDWARE).hardware
    world = (request.mount or config.camera.mount) == "world"
    kinematics = PandaKinematics(config.panda)
    if request.live:
        record_live(config, board, request.folder, console)
    registration, _, in_vain = read_camera(request.folder / layout.CAMERA_FILE, request.folder)
    for line in in_vain:
        console.print(f"{layout.CAMERA_FILE}: {line}", style="yellow", markup=False, highlight=False)
    k = registration.color.intrinsics
    views, without = _views(request.folder, board, kinematics)
    found = calibrated(views, k, world=world)
    corners = sum(len(view.uv) for view in views)
    console.print(
        f"{len(views) - len(found.left_out)} views of {len(views) + without}, {corners} corners, "
        f"{found.residual:.2f} pixels from where they should be (root mean square)",
        highlight=False,
    )
    for line in (*_told(found, world, kinematics), *_doubts(found, without)):
        console.print(line, highlight=False, soft_wrap=True)
    lines = scenario_lines(found.X, world)
    console.print(lines, markup=False, highlight=False, soft_wrap=True)
    if request.output is not None:
        write_told(request.output, f"{lines}\n".encode())


def board_of(words: Sequence[str]) -> CalibrationBoard:
    """A board as it is named on the command line, in mm. Raises CalibrationError."""
    kind, size, length, other = words
    try:
        columns, rows = (int(number) for number in size.split("x"))
        board = CalibrationBoard(kind, columns, rows, float(length) / 1000, float(other) / 1000)
    except ValueError:
        raise CalibrationError(
            f"--board {' '.join(words)}: expected a kind, columns and rows, and two lengths in mm, such as "
            "charuco 7x5 40 30"
        ) from None
    try:
        board.check()
    except ValueError as error:
        raise CalibrationError(f"--board {' '.join(words)}: {error}") from None
    return board


def scenario_lines(X: NDArray[np.float64], world: bool) -> str:
    """The camera's pose [4, 4] as a scenario has it: x, y, z in m, roll, pitch, yaw in rad."""
    turned = RollPitchYaw(RigidTransform(X).rotation()).vector()
    numbers = ", ".join(f"{number:.6f}" for number in (*X[:3, 3], *turned))
    place = (
        f"  camera:\n    mount: world\n    X_WC: [{numbers}]" if world else f"  panda:\n    X_EC: [{numbers}]"
    )
    return f"station: !HardwareStationConfig\n{place}"


def _views(folder: Path, board: CalibrationBoard, kinematics: PandaKinematics) -> tuple[list[BoardView], int]:
    """The views in a folder that show enough of the board, and how many do not. Raises RecordingError."""
    lens = read_camera(folder / layout.CAMERA_FILE, folder)[0].color
    listed, _ = read_file_list(folder / layout.COLOR_LIST, folder)
    joints = read_table(folder / layout.JOINT_LIST, 8, ",", folder)
    tip = read_table(folder / TIP_LIST, 8, None, folder)
    if joints is None and tip is None:
        raise RecordingError(
            f"{folder} says of no view where the arm was: it needs {layout.JOINT_LIST} (timestamp,q1..q7) or "
            f"{TIP_LIST} (timestamp tx ty tz qx qy qz qw, the tip's pose X_WE)"
        )
    views, without = [], 0
    for file in listed:
        if joints is not None:
            q = row_between(joints[0], file.time, STAMP_LIMIT)
            X_WE = None if q is None else kinematics.X_WE(q)
        else:
            assert tip is not None
            X_WE = pose_between(tip[0], file.time, STAMP_LIMIT)
        try:
            image = read_image(folder / file.name, jpeg=True, inside=folder)
        except DamagedImageError as error:
            raise RecordingError(str(error)) from None
        if image.shape[:2] != lens.intrinsics.shape or image.dtype != np.uint8:
            raise RecordingError(
                f"{folder / file.name} has {image.shape[1]}x{image.shape[0]} pixels of {image.dtype}; "
                f"{layout.CAMERA_FILE} says {lens.intrinsics.width}x{lens.intrinsics.height}, of 8 bits"
            )
        gray = image if image.ndim == 2 else cv2.cvtColor(image[..., :3], cv2.COLOR_BGR2GRAY)
        p_BQ, uv = board.corners(gray)
        if X_WE is None or len(uv) < FEWEST:
            without += 1
            continue
        views.append(BoardView(file.name, X_WE, p_BQ, project(lens.rays_at(uv), lens.intrinsics)))
    return views, without


def _told(found: CameraCalibration, world: bool, kinematics: PandaKinematics) -> list[str]:
    """What was found, in lines."""
    what = "X_WC" if world else "X_EC"
    lines = [
        f"{what}: standard errors {1e3 * found.translation_error:.2f} mm and "
        f"{np.degrees(found.rotation_error):.3f} degrees, if arm, board and intrinsics are right"
    ]
    if world:
        return lines
    apart = inverse(kinematics.X_EC) @ found.X
    turn = np.degrees(np.linalg.norm(log_se3(apart)[:3]))
    height, tilt = found.Y[2, 3], np.degrees(np.arccos(min(abs(found.Y[2, 2]), 1.0)))
    return [
        *lines,
        f"that is {1e3 * np.linalg.norm(apart[:3, 3]):.1f} mm and {turn:.2f} degrees from the scenario's",
        f"table: the board lies {1e3 * height:.1f} mm high and tilted by {tilt:.2f} degrees in the arm's base "
        "frame; both should be near 0 but for the board's thickness",
    ]


def _doubts(found: CameraCalibration, without: int) -> list[str]:
    """What a person should look at, in lines."""
    lines = []
    if found.left_out:
        lines.append(f"left out, as they do not fit the others: {', '.join(found.left_out)}")
    if without:
        lines.append(f"left out: {without} without enough of the board, or without a pose at their time")
    if found.residual > GOOD:
        lines.append(
            f"the corners are more than {GOOD:g} pixel off: is the board flat, are its lengths and the "
            "intrinsics right, and did the arm stand still?"
        )
    if found.translation_error > SURE[0] or found.rotation_error > SURE[1]:
        lines.append("that is not sure yet: take more views, nearer ones, and tilted more and to more sides")
    return lines
