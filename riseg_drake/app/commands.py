"""From what was asked for on the command line to the function that does it.

Commands are imported when they are called: `riseg --help` shall not wait for Drake.
"""

import argparse
import os
from dataclasses import fields
from typing import Any, TypeVar

from rich.console import Console

Request = TypeVar("Request")


def run(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg run`."""
    from riseg_drake.app.run.command import RunRequest, run_command

    run_command(_request(RunRequest, chosen), console)


def evaluate(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg evaluate`. Raises EvaluationError for options that do not go together."""
    from riseg_drake.app.evaluate.command import EvaluationError

    kind, others = _evaluation_of(chosen.suite)
    for name in others:
        if getattr(chosen, name):
            raise EvaluationError(f"--{name} does not go with {kind}; see riseg evaluate --help")
    if chosen.suite == "films":
        from riseg_drake.app.evaluate.films import films_command

        return films_command(
            chosen.seed, chosen.recordings, chosen.output, chosen.scenario, chosen.overwrite, console
        )
    if chosen.suite is not None:
        from riseg_drake.app.evaluate.suite import SuiteRequest, suite_command

        return suite_command(_request(SuiteRequest, chosen), console)
    from riseg_drake.app.evaluate.command import EvaluationRequest, evaluate_command

    evaluate_command(_request(EvaluationRequest, chosen), console)


def _evaluation_of(suite: str | None) -> tuple[str, list[str]]:
    """A kind of evaluation, as one would say it, and the options that only others have."""
    scenes, own = ["objects", "baseline", "masks"], ["scenario", "recordings"]
    if suite is None:
        return "an evaluation without --suite films", ["recordings"]
    if suite == "films":
        return "--suite films", [*scenes, "ablation", "scenes", "dask"]
    return f"--suite {suite}", scenes + own


def hardware(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg hardware`."""
    # Threads that wait for each other busily take the processor from the drivers and from the commands.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from riseg_drake.app.hardware.command import HardwareRequest, hardware_command

    hardware_command(_request(HardwareRequest, chosen), console)


def drive_arm(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg drive-arm`."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from riseg_drake.app.hardware.drive_arm import DriveRequest, drive_arm_command

    drive_arm_command(_request(DriveRequest, chosen), console)


def hand_eye(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg hand-eye`."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from riseg_drake.app.hardware.hand_eye import hand_eye_command

    hand_eye_command(chosen.scenario, chosen.output, chosen.yes, chosen.overwrite, console)


def calibrate(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg calibrate`."""
    from riseg_drake.app.hardware.calibrate import CalibrateRequest, calibrate_command

    calibrate_command(_request(CalibrateRequest, chosen), console)


def drive_camera(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg drive-camera`."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from riseg_drake.app.hardware.drive_camera import drive_camera_command

    drive_camera_command(chosen.scenario, chosen.file, console)


def emulate(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg emulate`."""
    from riseg_drake.app.emulate import emulate_command

    emulate_command(
        chosen.scenario, chosen.seed, chosen.control_mode, chosen.fault, chosen.say, chosen.judge, console
    )


def segment(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg segment`."""
    from riseg_drake.app.segment.command import SegmentRequest, segment_command

    segment_command(_request(SegmentRequest, chosen), console)


def convert(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg convert`."""
    from riseg_drake.app.segment.convert import ConvertRequest, convert_command

    convert_command(_request(ConvertRequest, chosen), console)


def score(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg score`."""
    from riseg_drake.app.evaluate.score import score_command
    from riseg_drake.evaluation.label_folders import LabelConventions

    conventions = LabelConventions(chosen.ignore, chosen.background, chosen.predicted_background)
    score_command(chosen.predicted, chosen.true, chosen.json, console, conventions)


def bench(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg bench`."""
    if chosen.raft:
        from riseg_drake.app.bench.raft import raft_bench_command

        return raft_bench_command(chosen.scenario, console)
    if chosen.stops:
        from riseg_drake.app.bench.stop import bench_stops

        return bench_stops(console)
    if chosen.driver:
        from riseg_drake.app.bench.driver import bench_driver

        return bench_driver(console)
    if chosen.sweep:
        from riseg_drake.app.bench.sweep import sweep_command

        return sweep_command(chosen.scenario, chosen.seed, chosen.json, console)
    if chosen.run:
        from riseg_drake.app.bench.whole_run import bench_run

        return bench_run(chosen.scenario, chosen.seed, chosen.json, console)
    from riseg_drake.app.bench.command import bench_command

    bench_command(
        chosen.scenario, chosen.seed, chosen.stream, chosen.sam, chosen.json, console, view=chosen.view
    )


def doctor(chosen: argparse.Namespace, console: Console) -> int:
    """`riseg doctor`; returns its exit code."""
    from riseg_drake.app.doctor.command import doctor_command

    return doctor_command(chosen.scenario, console)


def diagram(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg diagram`."""
    from riseg_drake.app.show.drawing import diagram_command

    diagram_command(chosen.scenario, chosen.output, console)


def pictures(chosen: argparse.Namespace, console: Console) -> None:
    """`riseg pictures`."""
    from riseg_drake.app.show.command import pictures_command

    pictures_command(chosen.scenario, chosen.seed, chosen.output, chosen.evaluation, chosen.overwrite, console)


def _request(kind: type[Request], chosen: argparse.Namespace) -> Request:
    """What was chosen, as a command's dataclass has it.

    The options have the names of its fields; those left open are as it has them.
    """
    names = [field.name for field in fields(kind)]  # type: ignore[arg-type]
    values: dict[str, Any] = {name: getattr(chosen, name) for name in names}
    return kind(**{name: value for name, value in values.items() if value is not None})
