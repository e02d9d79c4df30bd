"""The options of all commands that read a recording."""

import argparse


def add_source_options(command: argparse.ArgumentParser) -> None:
    """What a person may say of a recording that it does not say itself."""
    command.add_argument(
        "--topics",
        type=_topics,
        metavar="WHAT=NAME,...",
        help="topics of a bag, or folders of images: color, depth, color_info, depth_info, pose, joints "
        "(what fits together, if that is one pair)",
    )
    command.add_argument(
        "--rate",
        type=_rate,
        metavar="HZ",
        help="images a second, where names are numbers and there is no rgb.txt",
    )
    command.add_argument(
        "--world-frame", metavar="NAME", help="frame of a bag's TF that poses are given in (the topmost)"
    )


def _topics(text: str) -> dict[str, str]:
    pairs = [part.partition("=") for part in text.split(",")]
    if not all(name and value for name, _, value in pairs):
        raise argparse.ArgumentTypeError(f"{text!r} is not WHAT=NAME, or several of them with commas between")
    return {name.strip(): value.strip() for name, _, value in pairs}


def _rate(text: str) -> float:
    try:
        rate = float(text)
    except ValueError:
        rate = -1.0
    if not 1e-3 <= rate <= 1e4:
        raise argparse.ArgumentTypeError(f"{text!r} is not a rate from 0.001 to 10000 Hz")
    return rate
