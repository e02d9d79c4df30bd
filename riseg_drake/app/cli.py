"""The command line, `riseg`: what can be asked for, and how it is said when something is wrong."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from rich.console import Console

BAD_INPUT = 2
INTERRUPTED = 130  # 128 + SIGINT, as shells have it


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(BAD_INPUT, f"{self.prog}: {message}; see {self.prog} --help\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code: 0 done, 2 bad input, 130 interrupted."""
    chosen = _parser().parse_args(arguments)
    # Before numpy is imported: on matrices of six by six the threads of linear algebra only wait for each
    # other, and sums that they share come out differently in their last bits.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        # Commands are imported when called: `riseg --help` shall not wait for Drake.
        chosen.call(chosen, Console())
    except KeyboardInterrupt as stop:
        print(f"riseg: stopped{f'; {stop}' if str(stop) else ''}", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # whoever read our output has enough, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except Exception as error:
        if not isinstance(error, _mistakes()):
            raise
        print(f"riseg: {error}", file=sys.stderr)
        return BAD_INPUT
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="riseg", description="Find the objects on a table by nudging them (rt-RISeg in Drake)."
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    run = _add(
        commands,
        "run",
        _run,
        "Nudge the objects of one simulated scene until each is found, and score the masks.\n"
        "Writes pictures, masks and scores of every interaction to the output folder.",
    )
    _add_scenario(run)
    run.add_argument("--seed", type=int, default=0, metavar="N", help="draws the scene and the noise (0)")
    run.add_argument("--output", type=Path, metavar="DIR", help="output folder (out/SCENARIO_seed_N)")
    run.add_argument("--record", action="store_true", help="also write every frame to DIR/recording")
    run.add_argument(
        "--meshcat",
        action=argparse.BooleanOptionalAction,
        default=False,
        help="show it in the browser and save the replay as DIR/replay.html (no)",
    )

    evaluate = _add(
        commands,
        "evaluate",
        _evaluate,
        "Run many scenes, and put their scores into the paper's table and figure.\n"
        "An evaluation that was stopped goes on where it was when the same command is given again.",
    )
    evaluate.add_argument("--scenes", type=_positive, default=20, metavar="N", help="how many (20)")
    evaluate.add_argument(
        "--seed",
        type=int,
        default=100,
        metavar="S",
        help="of the first scene, the others follow (100; the program was developed on 0 to 19)",
    )
    evaluate.add_argument("--objects", type=Path, metavar="DIR", help="draw from these SDF or URDF models")
    evaluate.add_argument("--jobs", type=_positive, default=1, metavar="J", help="scenes at a time (1)")
    evaluate.add_argument(
        "--output", type=Path, metavar="DIR", help="output folder (out/evaluate_SCENARIO_seed_S)"
    )
    evaluate.add_argument("--scenario", type=Path, metavar="FILE", help="a YAML file (the built-in simulation)")
    evaluate.add_argument("--dask", metavar="ADDRESS", help="hand the scenes to a running Dask cluster")
    evaluate.add_argument(
        "--ablation",
        action="store_true",
        help="also record the runs, and segment them as the paper has it, one switch at a time",
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

    score = _add(
        commands,
        "score",
        _score,
        "Compare two folders of label PNGs with equal names, image by image.\n"
        "Prints the ten figures of the field's protocol, as means over the images.",
    )
    score.add_argument("predicted", type=Path, metavar="PREDICTED", help="folder of predicted masks")
    score.add_argument("true", type=Path, metavar="TRUE", help="folder of true masks")
    score.add_argument("--json", type=Path, metavar="FILE", help="also write all figures, per image too")

    bench = _add(
        commands,
        "bench",
        _bench,
        "Measure time and memory of every stage of the segmentation for a 640x480 image pair.\n"
        "The pairs are a rendered push, held in memory; nothing is written.",
    )
    _add_scenario(bench)
    bench.add_argument("--seed", type=int, default=0, metavar="N", help="draws the scene and the noise (0)")
    bench.add_argument("--raft", action="store_true", help="measure RAFT instead, small and large")

    diagram = _add(
        commands,
        "diagram",
        _diagram,
        "Draw the wired diagram of a scenario, as DOT or (with graphviz installed) as SVG.\n"
        "Without an output file the DOT text goes to the terminal.",
    )
    _add_scenario(diagram)
    diagram.add_argument("--output", type=Path, metavar="FILE", help="a file that ends in .dot or .svg")
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


def _positive(text: str) -> int:
    number = int(text) if text.isdecimal() else 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1 up")
    return number


def _add_scenario(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "scenario",
        type=Path,
        nargs="?",
        metavar="SCENARIO",
        help="a YAML file (the built-in simulation)",
    )


def _run(chosen: argparse.Namespace, console: Console) -> None:
    from riseg_drake.app.run import run_command

    run_command(chosen.scenario, chosen.seed, chosen.output, chosen.record, chosen.meshcat, console)


def _evaluate(chosen: argparse.Namespace, console: Console) -> None:
    from riseg_drake.app.evaluate import evaluate_command

    evaluate_command(
        chosen.scenes,
        chosen.seed,
        chosen.objects,
        chosen.jobs,
        chosen.output,
        chosen.scenario,
        chosen.dask,
        chosen.ablation,
        chosen.baseline,
        chosen.masks,
        console,
    )


def _score(chosen: argparse.Namespace, console: Console) -> None:
    from riseg_drake.app.score_command import score_command

    score_command(chosen.predicted, chosen.true, chosen.json, console)


def _bench(chosen: argparse.Namespace, console: Console) -> None:
    if chosen.raft:
        from riseg_drake.app.raft_bench import raft_bench_command

        return raft_bench_command(chosen.scenario, console)
    from riseg_drake.app.bench import bench_command

    bench_command(chosen.scenario, chosen.seed, console)


def _diagram(chosen: argparse.Namespace, console: Console) -> None:
    from riseg_drake.app.drawing import diagram_command

    diagram_command(chosen.scenario, chosen.output, console)


def _mistakes() -> tuple[type[Exception], ...]:
    """The errors that tell a person what to do otherwise; any other is a fault of this program."""
    from riseg_drake.app.evaluate import EvaluationError
    from riseg_drake.app.graphics import NoGraphicsError
    from riseg_drake.app.output import OutputError
    from riseg_drake.app.scenario_file import ScenarioError
    from riseg_drake.app.scene_pool import ClusterError
    from riseg_drake.evaluation.label_folders import LabelFolderError
    from riseg_drake.learned.model_error import ModelError
    from riseg_drake.recording.layout import RecordingError
    from riseg_drake.stations.scene import SceneError

    return (
        NoGraphicsError,
        OutputError,
        ScenarioError,
        SceneError,
        LabelFolderError,
        RecordingError,
        EvaluationError,
        ClusterError,
        ModelError,
    )
