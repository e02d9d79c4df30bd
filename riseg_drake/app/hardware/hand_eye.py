"""`riseg hand-eye`: is the camera where the scenario says? The arm moves over a scene that stands still.

A camera on the wrist is judged by what it sees of that scene, one that is fixed to the world by what it sees of
the arm.
"""

import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.trajectories import PiecewisePolynomial
from rich.console import Console

from riseg_drake.app.hardware.arm_travel import straight_motion, travel
from riseg_drake.app.hardware.drivers import HardwareError, listening, wait_for_drivers
from riseg_drake.app.hardware.terminal_operator import TerminalOperator
from riseg_drake.app.output_folder import OutputFolder
from riseg_drake.app.planned_speed import check_limits, planned_limits
from riseg_drake.app.scenario import HARDWARE, Scenario, load_scenario
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.app.work_state import end_noted
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pushing.time_law import SpeedLimits
from riseg_drake.recording.whole_file import write_png
from riseg_drake.robot.kinematics import PandaKinematics, observation_posture, tip_pointing_down
from riseg_drake.robot.silhouette import RobotSilhouette
from riseg_drake.segmentation.above_table import objects_above_table
from riseg_drake.segmentation.hand_eye import draw_flow_error, flow_errors, verdict
from riseg_drake.segmentation.outline_error import draw_outline_error, outline_errors, outline_verdict
from riseg_drake.stations.command_process import CommandProcess
from riseg_drake.stations.hardware import HardwareCameraConfig, HardwareStationConfig, newest_sight
from riseg_drake.stations.lcm_reception import Reception

PARTS = r"(flow|outline)_\d+\.png"
"""What the check puts into its folder, beside the summary."""
OFFSETS = ((0.04, 0.0, 0.0), (0.0, 0.04, 0.1), (-0.04, 0.0, 0.0), (0.0, -0.04, -0.1), (0.0, 0.0, 0.0))
"""Where the tip goes from the observation posture, x and y in W, m, and by how much it turns, rad."""
IN_VIEW = ((0.0, 0.0, 0.0), (0.05, 0.12, 0.5), (0.05, -0.12, -0.5), (-0.08, 0.0, 0.0))
"""Before a fixed camera the tip goes there from the middle of the work area, likewise ..."""
HEIGHT_IN_VIEW = 0.1
"""... this high above the table, m."""
LONGEST_WAIT = 5.0
"""For a picture, s."""
SLOWER = 0.3
"""The arm moves at this share of the speed of other planned motions."""


def hand_eye_command(
    scenario_file: Path | None, output: Path | None, yes: bool, overwrite: bool, console: Console
) -> None:
    """Move, compare the flows, print the verdict, and leave it with pictures. Raises HardwareError."""
    scenario = load_scenario(scenario_file, HARDWARE)
    config = scenario.hardware
    check_limits(scenario)
    kinematics = PandaKinematics(config.panda, config.camera.fixed_pose)
    is_fixed = kinematics.fixed_camera is not None
    postures = (_postures_in_view if is_fixed else _postures)(kinematics, config)
    path = output or Path("out") / "hand_eye"
    with (
        OutputFolder(path, "hand-eye", PARTS, {"state": "running"}, overwrite=overwrite) as folder,
        end_noted(lambda state, end: folder.note(state=state, end=end), lambda: f"no verdict in {folder.path}"),
    ):
        frames = _watched_moves(scenario, kinematics, postures, TerminalOperator(console, yes), console)
        if is_fixed:
            told, drawn, name = _outlines_told(frames, console)
            how_drawn = "outlines of the arm in {}: drawn broad and blue, seen orange upon it"
        else:
            told, drawn, name = _flows_told(frames, console)
            how_drawn = "arrows of both flows in {}: expected broad and blue, observed orange upon it"
        with folder.writing():
            for index, picture in enumerate(drawn):
                write_png(folder.path / f"{name}_{index}.png", picture)
        # A fixed camera sees the table without the arm in the first picture.
        plane_W = objects_above_table(frames[0 if is_fixed else -1], scenario.above_table).plane_W
        folder.note(state="done", **told, **_table_told(plane_W, console))
    console.print(how_drawn.format(folder.path))


def _flows_told(frames: Sequence[Frame], console: Console) -> tuple[dict[str, Any], list[NDArray], str]:
    """Say what the flows show; returns that as figures, and some of them drawn. Raises HardwareError."""
    errors = flow_errors(frames)
    if not errors:
        raise HardwareError(
            f"{len(frames)} pictures came, with too little texture or depth in them to compare; "
            "put patterned things on the table"
        )
    median, words = verdict(errors)
    shift_u, shift_v = np.median([error.mean for error in errors], axis=0)
    console.print(
        f"hand-eye: observed and expected flow differ by {median:.2f} pixels (median of {len(errors)} pairs; "
        f"shared by all pixels: {shift_u:+.2f}, {shift_v:+.2f}): {words}"
    )
    figures = {
        "pairs": len(errors),
        "median_px": round(median, 3),
        "shift_px": [round(float(shift_u), 3), round(float(shift_v), 3)],
    }
    return figures, [draw_flow_error(error) for error in errors[:: max(len(errors) // 5, 1)]], "flow"


def _outlines_told(frames: Sequence[Frame], console: Console) -> tuple[dict[str, Any], list[NDArray], str]:
    """The same of the arm's outlines before a fixed camera; the first frame shows the scene without it."""
    errors = outline_errors(frames)
    if not errors:
        raise HardwareError(
            f"{len(frames)} pictures came, and the arm stands out in none by its depth; X_WC may be far off, "
            "or the camera see no depth there"
        )
    median, words = outline_verdict(errors)
    shift_u, shift_v = np.median([error.shift for error in errors], axis=0)
    console.print(
        f"hand-eye: the arm is seen {median:.1f} pixels from where it is drawn (median of {len(errors)} "
        f"pictures; shared by all: {shift_u:+.1f}, {shift_v:+.1f}): {words}"
    )
    figures = {
        "pictures": len(errors),
        "median_px": round(median, 2),
        "shift_px": [round(float(shift_u), 2), round(float(shift_v), 2)],
    }
    return figures, [draw_outline_error(error) for error in errors[:: max(len(errors) // 5, 1)]], "outline"


def _table_told(plane_W: NDArray, console: Console) -> dict[str, Any]:
    """Say where the table's plane [4] lies in the arm's frame; returns it as figures."""
    tilt = np.degrees(np.arccos(np.clip(plane_W[2], -1, 1)))
    console.print(
        f"table: {-1e3 * plane_W[3]:.1f} mm high and tilted by {tilt:.2f} degrees in the arm's base frame; "
        "both should be near 0"
    )
    return {
        "table_height_mm": round(-1e3 * float(plane_W[3]), 2),
        "table_tilt_deg": round(float(tilt), 3),
    }


def _watched_moves(
    scenario: Scenario,
    kinematics: PandaKinematics,
    postures: Sequence[NDArray],
    operator: TerminalOperator,
    console: Console,
) -> list[Frame]:
    """The pictures that came while the arm went from posture to posture, joint angles [7], rad."""
    config, limits = scenario.hardware, planned_limits(scenario)
    with listening(config, replayed=False, truth=False) as (reception, _):
        with console.status("waiting for arm and camera") as status:
            wait_for_drivers(reception, config, ready=True, say=status.update)
        camera = _Collector(reception, config.camera, kinematics)
        with CommandProcess(config.lcm, config.command, config.panda) as commands:
            operator.confirm(
                "the arm goes to where it looks from, and 4 cm around; nothing else may move"
                if kinematics.fixed_camera is None
                else "the arm shows itself before the camera, the tip 10 cm above the table; clear it"
            )
            for index, q in enumerate(postures):
                # The way there is not of interest; the moves after it are slow, for enough pictures.
                plan = partial(_move, kinematics, q, limits, SLOWER if index else 1.0)
                travel(plan, commands, reception, operator, camera.look if index else lambda: None)
                if index == 0:
                    camera.wait(reception)
    return camera.frames


class _Collector:
    """Keeps every picture with the arm's pose of its time."""

    def __init__(self, reception: Reception, config: HardwareCameraConfig, kinematics: PandaKinematics):
        self._reception, self._config, self._kinematics = reception, config, kinematics
        # Of flow what is near the arm is left out, too; an outline that is to be compared must have no margin.
        margins = (0.001, 1.0) if kinematics.fixed_camera is None else (0.0, 0.0)
        self._silhouette = RobotSilhouette(kinematics, config.intrinsics, *margins)
        self._newest = reception.clock()
        self.frames: list[Frame] = []

    def wait(self, reception: Reception) -> None:
        """Take in a picture that is taken from now on. Raises HardwareError where none comes."""
        self._newest, until, count = reception.clock(), reception.clock() + LONGEST_WAIT, len(self.frames)
        while len(self.frames) == count:
            if reception.clock() > until:
                raise HardwareError(f"no picture that can be used came for {LONGEST_WAIT:g} s")
            time.sleep(0.02)
            self.look()

    def look(self) -> None:
        """Take in the newest picture, if there is another."""
        sight = newest_sight(self._reception, self._config, after=self._newest)
        if sight is None:
            return
        self._newest = sight.sent
        self.frames.append(
            Frame(
                sequence=len(self.frames),
                time=sight.time,
                intrinsics=self._config.intrinsics,
                color=sight.color.data[..., :3].copy(),
                depth=sight.depth.data[..., 0].copy(),
                X_WC=self._kinematics.X_WC(sight.position),
                robot=self._silhouette.mask(sight.position),
            )
        )


def _move(
    kinematics: PandaKinematics, q_to: NDArray, limits: SpeedLimits, share: float, q_from: NDArray
) -> PiecewisePolynomial:
    """The straight motion at a share of its speed."""
    motion = straight_motion(kinematics, q_from, q_to, limits)
    motion.ScaleTime(1 / share)
    return motion


def _postures(kinematics: PandaKinematics, config: HardwareStationConfig) -> list[np.ndarray]:
    try:
        q = observation_posture(
            kinematics, config.centre_W, config.observe_height, config.start_position, config.observe_pitch
        )
    except ValueError as error:
        raise ScenarioError(str(error)) from None
    X_WE = kinematics.X_WE(q)
    yaw = float(np.arctan2(X_WE[1, 0], X_WE[0, 0]))
    postures = [q]
    for x, y, turn in OFFSETS:
        traced = kinematics.trace_ik(
            [
                tip_pointing_down(X_WE[:3, 3] + share * np.array([x, y, 0.0]), yaw + share * turn)
                for share in (0.5, 1.0)
            ],
            q,
        )
        if traced is None:
            raise ScenarioError("centre_W, observe_height: the arm cannot move by 4 cm there")
        postures.append(traced[-1])
    return postures


def _postures_in_view(kinematics: PandaKinematics, config: HardwareStationConfig) -> list[np.ndarray]:
    """Where the arm waits, and then postures before the fixed camera."""
    try:
        q = observation_posture(kinematics, config.centre_W, config.observe_height, config.start_position)
    except ValueError as error:
        raise ScenarioError(str(error)) from None
    postures = [q]
    for x, y, turn in IN_VIEW:
        p_WE = [config.centre_W[0] + x, config.centre_W[1] + y, HEIGHT_IN_VIEW]
        shown = kinematics.solve_ik(tip_pointing_down(p_WE, turn), postures[-1], min_clearance=0.02)
        if shown is None:
            raise ScenarioError("centre_W: the arm cannot move there with 2 cm to table and camera")
        postures.append(shown)
    return postures
