"""The options of the commands that are about the camera alone."""

import argparse
from pathlib import Path

from riseg_drake.app.options import add_scenario


def add_drive_camera_options(command: argparse.ArgumentParser) -> None:
    """Which camera, by the scenario, or which file."""
    add_scenario(command, built_in="the built-in hardware.yaml")
    command.add_argument(
        "--file", type=Path, metavar="FILE", help="play this .bag or .db3 of a RealSense camera instead, once"
    )
