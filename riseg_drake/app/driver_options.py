"""The options of the drivers, and of the camera's calibration."""

import argparse
import re
from pathlib import Path

from riseg_drake.app.options import add_scenario

HARDWARE = "the built-in hardware.yaml"
_HOST = re.compile(r"[\w.-]+")


def add_drive_arm_options(command: argparse.ArgumentParser) -> None:
    """Which robot, and whether it is only looked at."""
    add_scenario(command, built_in=HARDWARE)
    command.add_argument(
        "--ip", required=True, type=_host, metavar="A", help="address of the robot's control box, or its name"
    )
    command.add_argument(
        "--mode", choices=("velocity", "position"), help="what is commanded (the scenario's: velocity)"
    )
    command.add_argument(
        "--check", action="store_true", help="only read for 5 s, move nothing, and say what would not do"
    )


def add_drive_camera_options(command: argparse.ArgumentParser) -> None:
    """Which camera, by the scenario, or which file."""
    add_scenario(command, built_in=HARDWARE)
    command.add_argument(
        "--file", type=Path, metavar="FILE", help="play this .bag or .db3 of a RealSense camera instead, once"
    )


def add_calibrate_options(command: argparse.ArgumentParser) -> None:
    """Which views of which board, and what for."""
    command.add_argument(
        "folder",
        type=Path,
        nargs="?",
        metavar="FOLDER",
        help="rgb.txt and its images, camera.json, joints.csv or tip.txt (poses X_WE); with --live a new one",
    )
    command.add_argument(
        "--scenario", type=Path, metavar="FILE", help="a YAML file (the built-in hardware.yaml)"
    )
    command.add_argument(
        "--board",
        nargs=4,
        metavar=("KIND", "COLUMNSxROWS", "MM", "MM"),
        help="charuco, with the sides of squares and of markers (charuco 7x5 40 30), or apriltag, with that of "
        "tags and the room between them",
    )
    command.add_argument(
        "--mount",
        choices=("wrist", "world"),
        help="camera on the wrist over a board that lies still, or in the world with a carried board (as the "
        "scenario's station.camera.mount says)",
    )
    command.add_argument(
        "--live", action="store_true", help="take the views now, through the drivers; the arm is moved by hand"
    )
    command.add_argument(
        "--output", type=Path, metavar="FILE", help="also write the scenario's lines to this file"
    )
    command.add_argument(
        "--draw", type=Path, metavar="FILE", help="only draw the board, as a PNG to be printed"
    )


def _host(text: str) -> str:
    """An address or a name, and nothing beside it: libfranka has a port of its own."""
    if not _HOST.fullmatch(text):
        raise argparse.ArgumentTypeError(f"{text!r} is no address such as 172.16.0.2, without a port")
    return text
