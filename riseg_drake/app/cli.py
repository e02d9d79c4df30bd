"""The command line, `riseg`: one command is run, and what is wrong is said in one line."""

import os
import select
import sys
from collections.abc import Sequence

from rich.console import Console

from riseg_drake.app.arguments import BAD_INPUT, command_line

INTERRUPTED = 130  # 128 + SIGINT, as shells have it


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code: 0 done, 2 bad input, 130 interrupted."""
    chosen = command_line().parse_args(arguments)
    # Before numpy is imported: on matrices of six by six the threads of linear algebra only wait for each
    # other, and sums that they share come out differently in their last bits.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        chosen.call(chosen, Console())
    except KeyboardInterrupt as stop:
        print(f"riseg: stopped{f'; {stop}' if str(stop) else ''}", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        if not _nobody_reads():
            raise
        # Whoever read our output has enough, as `head` does.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except Exception as error:
        if not isinstance(error, _mistakes()):
            raise
        print(f"riseg: {error}", file=sys.stderr)
        return BAD_INPUT
    return 0


def _nobody_reads() -> bool:
    """Whether the reader of our output is gone; otherwise some other pipe has broken, which is a fault."""
    output = select.poll()
    output.register(sys.stdout.fileno(), 0)
    return any(events & select.POLLERR for _, events in output.poll(0))


def _mistakes() -> tuple[type[Exception], ...]:
    """The errors that tell a person what to do otherwise; any other is a fault of this program."""
    from riseg_drake.app.arm_travel import TravelError
    from riseg_drake.app.evaluate import EvaluationError
    from riseg_drake.app.graphics import NoGraphicsError
    from riseg_drake.app.hardware import HardwareError
    from riseg_drake.app.output import OutputError
    from riseg_drake.app.scenario_file import ScenarioError
    from riseg_drake.app.scene_pool import ClusterError
    from riseg_drake.evaluation.label_folders import LabelFolderError
    from riseg_drake.learned.model_error import ModelError
    from riseg_drake.recording.layout import RecordingError
    from riseg_drake.robot.own_robot import OwnRobotError
    from riseg_drake.stations.command_process import CommandError
    from riseg_drake.stations.lcm_channels import LcmError
    from riseg_drake.stations.lcm_images import ImageError
    from riseg_drake.stations.misbehaviour import WordError
    from riseg_drake.stations.object_models import SceneError
    from riseg_drake.stations.panda_driver import DriverEndedError

    return (
        NoGraphicsError,
        OutputError,
        ScenarioError,
        SceneError,
        LabelFolderError,
        RecordingError,
        OwnRobotError,
        EvaluationError,
        ClusterError,
        LcmError,
        ImageError,
        CommandError,
        HardwareError,
        TravelError,
        WordError,
        DriverEndedError,
        ModelError,
    )
