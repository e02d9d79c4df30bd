"""What can be asked of `riseg` on the command line."""

import argparse
from pathlib import Path

from riseg_drake.app import commands
from riseg_drake.app.driver_options import (
    HARDWARE,
    add_calibrate_options,
    add_drive_arm_options,
    add_drive_camera_options,
)
from riseg_drake.app.export_options import add_export
from riseg_drake.app.measuring_options import add_bench_options, add_score_options
from riseg_drake.app.options import (
    add_overwrite,
    add_rerun,
    add_scenario,
    add_source,
    add_view,
    positive,
    seed_number,
)
from riseg_drake.app.package import package_version
from riseg_drake.app.parser import Parser


def command_line() -> argparse.ArgumentParser:
    """The parser of all commands; what it returns has the chosen command's function as `call`."""
    parser = Parser(
        prog="riseg", description="Find the objects on a table by nudging them (rt-RISeg in Drake)."
    )
    parser.add_argument("--version", action="version", version=f"riseg {package_version()}")
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    run = _add(
        subparsers,
        "run",
        commands.run,
        "Nudge the objects of one simulated scene until each is found, and score the masks.\n"
        "Writes pictures, masks and scores of every interaction to the output folder.",
    )
    add_scenario(run)
    run.add_argument(
        "--seed", type=seed_number, default=0, metavar="N", help="draws the scene and the noise (0)"
    )
    run.add_argument("--output", type=Path, metavar="DIR", help="output folder (out/SCENARIO_seed_N)")
    add_overwrite(run, "run")
    run.add_argument("--record", action="store_true", help="also write every frame to DIR/recording")
    add_view(run)
    add_export(run)
    add_rerun(run)

    evaluate = _add(
        subparsers,
        "evaluate",
        commands.evaluate,
        "Run many scenes, and put their scores into the paper's table and figure.\n"
        "An evaluation that was stopped goes on where it was when the same command is given again.",
    )
    evaluate.add_argument(
        "--suite",
        metavar="NAME",
        help="scenes of several kinds, a row each: clutter, or a folder of YAML files, one a kind; films: "
        "of still things by a camera that moves and errs",
    )
    evaluate.add_argument(
        "--scenes", type=positive, metavar="N", help="how many (20); of a suite, of each kind (5)"
    )
    evaluate.add_argument(
        "--seed",
        type=seed_number,
        default=100,
        metavar="S",
        help="of the first scene, the others follow (100; the program was developed on 0 to 19)",
    )
    evaluate.add_argument("--objects", type=Path, metavar="DIR", help="draw from these SDF or URDF models")
    evaluate.add_argument("--jobs", type=positive, default=1, metavar="J", help="scenes at a time (1)")
    evaluate.add_argument(
        "--output", type=Path, metavar="DIR", help="output folder (out/evaluate_SCENARIO_seed_S)"
    )
    add_overwrite(evaluate, "evaluation")
    evaluate.add_argument(
        "--recordings", type=Path, metavar="DIR", help="with --suite films: also segment the recordings in DIR"
    )
    evaluate.add_argument("--scenario", type=Path, metavar="FILE", help="a YAML file (the built-in simulation)")
    evaluate.add_argument("--dask", metavar="ADDRESS", help="hand the scenes to a running Dask cluster")
    evaluate.add_argument(
        "--ablation",
        action="store_true",
        help="also record the runs, and segment them as the paper has it, or without a part, one at a time",
    )

    evaluate.add_argument(
        "--baseline", choices=("sam",), help="also score Segment Anything, alone and with our masks as prompts"
    )
    evaluate.add_argument(
        "--masks",
        action="append",
        default=[],
        metavar="NAME=DIR",
        help="also score another method's DIR/scene_000/step_1/mask.png ...; may be given again",
    )

    hardware = _add(
        subparsers,
        "hardware",
        commands.hardware,
        "The same on a real Panda with a RealSense camera, over their drivers on LCM; see docs/hardware.md.\n"
        "The operator confirms every push; --dry-run shows pushes and moves nothing.",
    )
    add_scenario(hardware, built_in=HARDWARE)
    hardware.add_argument("--seed", type=seed_number, default=0, metavar="N", help="draws samples (0)")
    hardware.add_argument("--output", type=Path, metavar="DIR", help="output folder (out/SCENARIO_TIME)")
    hardware.add_argument("--record", action="store_true", help="also write every frame to DIR/recording")
    add_view(hardware)
    hardware.add_argument(
        "--dry-run", action="store_true", help="show every planned push in the browser, and move nothing"
    )
    hardware.add_argument("--yes", action="store_true", help="do not ask before the arm moves")
    hardware.add_argument(
        "--truth", action="store_true", help="score the masks by the ground truth of `riseg emulate`"
    )
    hardware.add_argument(
        "--replayed",
        action="store_true",
        help="hear a log that lcm-logplayer plays: old time stamps count as new, nothing is moved",
    )
    add_export(hardware)
    add_rerun(hardware)

    hand_eye = _add(
        subparsers,
        "hand-eye",
        commands.hand_eye,
        "Move a real arm a little over a scene that stands still, and compare expected with observed flow.\n"
        "Says in pixels how well the camera's pose on the arm is known, and where the table is.",
    )
    add_scenario(hand_eye, built_in=HARDWARE)
    hand_eye.add_argument("--output", type=Path, metavar="DIR", help="folder for pictures (out/hand_eye)")
    add_overwrite(hand_eye, "check")
    hand_eye.add_argument("--yes", action="store_true", help="do not ask before the arm moves")

    add_calibrate_options(
        _add(
            subparsers,
            "calibrate",
            commands.calibrate,
            "Find where the camera is on the arm, or in the world, by views of a ChArUco or AprilTag board.\n"
            "Prints the scenario's lines, how sure they are, and where the board lies.",
        )
    )

    add_drive_camera_options(
        _add(
            subparsers,
            "drive-camera",
            commands.drive_camera,
            "Publish colour and aligned depth of a RealSense camera, or of its file, on LCM until Ctrl-C.\n"
            "Prints the camera's intrinsics as the scenario wants them.",
        )
    )

    add_drive_arm_options(
        _add(
            subparsers,
            "drive-arm",
            commands.drive_arm,
            "Drive a Franka Research 3 or a Panda: commands from LCM to libfranka, the robot's state back.\n"
            "Runs until Ctrl-C; after a stop it waits for the operator's word in `riseg hardware`.",
        )
    )

    emulate = _add(
        subparsers,
        "emulate",
        commands.emulate,
        "Stand in for the drivers of a Panda and a RealSense camera on LCM, around a simulated scene.\n"
        "Runs at wall-clock time until Ctrl-C, and misbehaves when it is told to.",
    )
    add_scenario(emulate)
    emulate.add_argument(
        "--seed", type=seed_number, default=0, metavar="N", help="draws scene, noise and faults (0)"
    )
    emulate.add_argument(
        "--control-mode",
        choices=("status_only", "velocity", "position"),
        help="the arm driver's flag (as the scenario says: velocity)",
    )
    emulate.add_argument(
        "--fault",
        action="append",
        default=[],
        metavar="WORD",
        help="misbehave from the start, such as 'images drop 0.1' or 'status delay 0.03'; may be repeated",
    )
    emulate.add_argument(
        "--say",
        metavar="WORD",
        help="tell a running emulator: reflex, stop, recover, start, die, 'guide 1 0.3', or a fault",
    )
    emulate.add_argument(
        "--judge",
        type=Path,
        metavar="FILE",
        help="write at the end how calm the arm's own motion was, as shares of its limits (JSON)",
    )

    segment = _add(
        subparsers,
        "segment",
        commands.segment,
        "Find the objects of a recording, without a robot: masks, a video, and scores where there are labels.\n"
        "A recording is a ROS bag, or a folder of images with a camera.json, see docs/recordings.md.",
    )
    segment.add_argument(
        "recording",
        type=Path,
        nargs="?",
        metavar="RECORDING",
        help="its folder, or the file of a bag (the sample that ships with the package)",
    )
    segment.add_argument("--output", type=Path, metavar="DIR", help="output folder (out/segment_NAME)")
    add_overwrite(segment, "segmentation")
    segment.add_argument(
        "--scenario",
        type=Path,
        metavar="FILE",
        help="a YAML file (the recorded run's, or the built-in one)",
    )
    segment.add_argument(
        "--seed", type=seed_number, metavar="N", help="draws the samples (that of the recorded run, or 0)"
    )
    segment.add_argument(
        "--robot", type=Path, metavar="FILE", help="URDF or SDF of the robot that joints.csv is of (the Panda)"
    )
    segment.add_argument(
        "--camera-frame",
        default="camera",
        metavar="NAME",
        help="frame of that robot: x right, y down, z ahead in the image (camera)",
    )
    add_source(segment)
    segment.add_argument(
        "--overlay",
        action="store_true",
        help="also write each picture of the video as a PNG, without the bar of time, to DIR/overlay (no)",
    )
    add_export(segment)
    add_rerun(segment)
    segment.add_argument(
        "--strict",
        action="store_true",
        help="refuse a recording that can hardly be right (it is said, and read)",
    )

    convert = _add(
        subparsers,
        "convert",
        commands.convert,
        "Write any recording that `riseg segment` reads as a folder in the project's own layout.\n"
        "Colour without distortion, depth aligned to it, poses and joint angles as far as there are any.",
    )
    convert.add_argument("recording", type=Path, metavar="RECORDING", help="its folder, or the file of a bag")
    convert.add_argument("output", type=Path, metavar="FOLDER", help="a new folder")
    add_source(convert)

    add_score_options(
        _add(
            subparsers,
            "score",
            commands.score,
            "Compare two folders of label PNGs with equal names, image by image.\n"
            "Prints the ten figures of the field's protocol, as means over the images.",
        )
    )

    add_bench_options(
        _add(
            subparsers,
            "bench",
            commands.bench,
            "Measure time and memory of every stage of the segmentation for a 640x480 image pair.\n"
            "The pairs are a rendered push, held in memory; nothing is written.",
        )
    )

    doctor = _add(
        subparsers,
        "doctor",
        commands.doctor,
        "Say what this machine and this installation can do, each with its remedy where it lacks something.\n"
        "Ends with 1 where something is missing that simulating and segmenting need.",
    )
    add_scenario(doctor, "a YAML file, for its LCM network and channels", HARDWARE)

    diagram = _add(
        subparsers,
        "diagram",
        commands.diagram,
        "Draw the wired diagram of a scenario, as DOT or (with graphviz installed) as SVG.\n"
        "Without an output file the DOT text goes to the terminal.",
    )
    add_scenario(diagram)
    diagram.add_argument("--output", type=Path, metavar="FILE", help="a file that ends in .dot or .svg")

    pictures = _add(
        subparsers,
        "pictures",
        commands.pictures,
        "Make the pictures of the documentation anew: one run as a film and as a strip, the wired diagrams.\n"
        "With --evaluation also the figure of an evaluation.",
    )
    add_scenario(pictures)
    pictures.add_argument(
        "--seed", type=seed_number, default=4, metavar="N", help="draws the scene and the noise (4)"
    )
    pictures.add_argument(
        "--output", type=Path, default=Path("out/pictures"), metavar="DIR", help="folder (out/pictures)"
    )
    pictures.add_argument("--overwrite", action="store_true", help="replace earlier pictures there (no)")
    pictures.add_argument(
        "--evaluation",
        type=Path,
        metavar="DIR",
        help="output folder of `riseg evaluate`, to take its figure from",
    )
    return parser


def _add(commands, name, call, explanation) -> argparse.ArgumentParser:  # type: ignore[no-untyped-def]
    command = commands.add_parser(
        name,
        help=explanation.splitlines()[0],
        description=explanation,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.set_defaults(call=call)
    return command
