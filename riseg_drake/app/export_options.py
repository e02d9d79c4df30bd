"""The options of all commands that write masks for other tools."""

import argparse

from riseg_drake.export.formats import FORMATS


def add_export(command: argparse.ArgumentParser) -> None:
    """Let a command be asked for exports."""
    command.add_argument(
        "--export",
        type=_formats,
        default=(),
        metavar="FORMATS",
        help=f"also write the masks for other tools, to DIR/export; any of {','.join(FORMATS)} (none)",
    )
    command.add_argument(
        "--export-frames",
        type=_frame_numbers,
        default=(),
        metavar="NUMBERS",
        help="frames that npz gets, counted from 0, such as 0,30 (the last one)",
    )


def _formats(text: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(filter(None, (name.strip() for name in text.split(",")))))
    unknown = [name for name in names if name not in FORMATS]
    if unknown or not names:
        what = f"{unknown[0][:30]!r} is no format" if unknown else "no format is named"
        raise argparse.ArgumentTypeError(f"{what}; the formats are {', '.join(FORMATS)}")
    return names


def _frame_numbers(text: str) -> tuple[int, ...]:
    words = text.split(",")
    if not all(word.isdecimal() and len(word) < 10 for word in words):
        raise argparse.ArgumentTypeError(f"{text[:30]!r} is no list of frame numbers, such as 0,30,60")
    return tuple(map(int, words))
