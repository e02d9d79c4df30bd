"""Options that several commands of `riseg` have, and the numbers that they take."""

import argparse
from pathlib import Path

from riseg_drake.app.source_options import add_source_options

IN_OUTPUT = Path()
"""Stands for `--rerun` without a file: it goes to the output folder, and to a viewer that is opened."""


def positive(text: str) -> int:
    """A whole number from 1 up."""
    number = int(text) if text.isdecimal() else 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1 up")
    return number


def seed_number(text: str) -> int:
    """A whole number from 0 to 999999999."""
    if not text.isdecimal() or len(text) > 9:
        raise argparse.ArgumentTypeError(f"{text[:20]!r} is not a whole number from 0 to 999999999")
    return int(text)


def seconds(text: str) -> float:
    """A time above 0, s."""
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not 0 < number < 1e6:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds above 0")
    return number


def add_source(command: argparse.ArgumentParser) -> None:
    """What a person may say of a recording that it does not say itself."""
    command.add_argument(
        "--stamp-limit",
        type=seconds,
        default=0.02,
        metavar="S",
        help="how far apart in time what belongs together may be, s (0.02)",
    )
    command.add_argument(
        "--follow", action="store_true", help="follow links and paths that lead out of the recording (no)"
    )
    add_source_options(command)


def add_overwrite(command: argparse.ArgumentParser, earlier: str) -> None:
    """Whether an `earlier` run, evaluation or the like is removed."""
    command.add_argument(
        "--overwrite", action="store_true", help=f"remove an earlier {earlier} from the output folder (no)"
    )


def add_view(command: argparse.ArgumentParser) -> None:
    """Whether it is shown in the browser, and whether that view stays."""
    command.add_argument(
        "--meshcat",
        action=argparse.BooleanOptionalAction,
        default=False,
        help="show it in the browser and save the replay as DIR/replay.html (no)",
    )
    command.add_argument(
        "--wait",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="keep the browser's view until Enter once it is over (yes, at a terminal)",
    )


def add_rerun(command: argparse.ArgumentParser) -> None:
    """Whether all is logged for Rerun's viewer, and where to."""
    command.add_argument(
        "--rerun",
        type=Path,
        nargs="?",
        const=IN_OUTPUT,
        metavar="FILE",
        help="log all that is seen and found for Rerun's viewer, to FILE.rrd; without FILE to DIR/rerun.rrd, "
        "and to a viewer that is opened where there is a screen (no)",
    )


def add_scenario(
    command: argparse.ArgumentParser, what: str = "a YAML file", built_in: str = "the built-in simulation"
) -> None:
    """The scenario, which may be left out: what is asked for, and what is taken then."""
    command.add_argument("scenario", type=Path, nargs="?", metavar="SCENARIO", help=f"{what} ({built_in})")
