"""The command line, `riseg`: one command is run, and what is wrong is said in one line."""

import os
import warnings
from collections.abc import Sequence

from rich.console import Console

from riseg_drake.app import commands
from riseg_drake.app.arguments import command_line
from riseg_drake.app.parser import BAD_INPUT
from riseg_drake.host.processes import Stop, stopped_by_signals
from riseg_drake.host.terminal import can_write, drop_output, nobody_reads, tell_error, tell_notices


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code: 0 done, 1 a doctor's that something lacks, 2 bad input or not
    done, 128 and the signal's number when stopped."""
    chosen = command_line().parse_args(arguments)
    # Before numpy is imported: on matrices of six by six the threads of linear algebra only wait for each
    # other, and sums that they share come out differently in their last bits.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Of a library that only evaluations with several jobs use, and these say it themselves.
    warnings.filterwarnings("ignore", message=".*joblib will operate in serial mode", category=UserWarning)
    tell_notices()
    code = 0
    with stopped_by_signals(commands.__file__, __file__) as stop:
        try:
            code = chosen.call(chosen, Console(markup=False)) or 0  # what is said may hold anybody's brackets
        except KeyboardInterrupt as interrupt:
            return _stopped(stop, f"stopped; {interrupt}" if str(interrupt) else "stopped")
        except BrokenPipeError:
            if not nobody_reads():
                raise
            # Whoever read our output has enough, as `head` does.
            drop_output()
        except Exception as error:
            if stop.signal:  # what a library has made of the KeyboardInterrupt in its midst
                return _stopped(stop, "stopped")
            if not isinstance(error, _mistakes()):
                raise
            return _refused(error)
        try:
            can_write()
        except OSError as error:
            return _refused(error)
    return code


def _stopped(stop: Stop, words: str) -> int:
    tell_error(words)
    return stop.exit_code


def _refused(error: Exception) -> int:
    words = str(error)
    if isinstance(error, OSError):
        # No room, no permission, no such place: the machine refuses, wherever in the program that is noticed.
        words = f"{error.filename or 'the output'}: {error.strerror or words}"
    try:
        can_write()
    except OSError as full:
        words = f"the output: {full.strerror}"
        drop_output()
    tell_error(words)
    return BAD_INPUT


def _mistakes() -> tuple[type[Exception], ...]:
    """The errors that tell a person what to do otherwise; any other is a fault of this program."""
    from riseg_drake.app.emulate import CameraDiedError
    from riseg_drake.app.evaluate.command import EvaluationError
    from riseg_drake.app.evaluate.scene_pool import PoolError
    from riseg_drake.app.graphics import NoGraphicsError
    from riseg_drake.app.hardware.arm_travel import TravelError
    from riseg_drake.app.hardware.drivers import HardwareError
    from riseg_drake.app.output_folder import OutputError
    from riseg_drake.app.scenario_file import ScenarioError
    from riseg_drake.app.work_state import RunStoppedError
    from riseg_drake.evaluation.label_folders import LabelFolderError
    from riseg_drake.evaluation.true_things import ThingsError
    from riseg_drake.export.export_error import ExportError
    from riseg_drake.learned.model_error import ModelError
    from riseg_drake.recording.layout import RecordingError
    from riseg_drake.robot.camera_calibration import CalibrationError
    from riseg_drake.robot.own_robot import OwnRobotError
    from riseg_drake.segmentation.table_plane import NoPlaneError
    from riseg_drake.stations.command_process import CommandError
    from riseg_drake.stations.franka_link import LinkError
    from riseg_drake.stations.lcm_channels import LcmError
    from riseg_drake.stations.lcm_images import ImageError
    from riseg_drake.stations.misbehaviour import WordError
    from riseg_drake.stations.object_models import SceneError
    from riseg_drake.stations.physics import PhysicsError
    from riseg_drake.stations.realsense import RealSenseError
    from riseg_drake.timeline.file import TimelineError

    return (
        OSError,
        NoGraphicsError,
        OutputError,
        CameraDiedError,
        ScenarioError,
        SceneError,
        PhysicsError,
        LabelFolderError,
        ThingsError,
        RecordingError,
        OwnRobotError,
        NoPlaneError,
        EvaluationError,
        PoolError,
        LcmError,
        RealSenseError,
        CalibrationError,
        LinkError,
        ImageError,
        CommandError,
        HardwareError,
        RunStoppedError,
        TravelError,
        WordError,
        ModelError,
        ExportError,
        TimelineError,
    )
