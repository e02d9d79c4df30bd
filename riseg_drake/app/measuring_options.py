"""The options of the commands that measure: scores of masks, time and memory."""

import argparse
from pathlib import Path

from riseg_drake.app.options import add_scenario, positive, seed_number


def add_score_options(command: argparse.ArgumentParser) -> None:
    """Which masks are compared with which, and what does not count."""
    command.add_argument("predicted", type=Path, metavar="PREDICTED", help="folder of predicted masks")
    command.add_argument("true", type=Path, metavar="TRUE", help="folder of true masks")
    command.add_argument("--json", type=Path, metavar="FILE", help="also write all figures, per image too")
    command.add_argument(
        "--ignore",
        type=seed_number,
        metavar="ID",
        help="true value whose pixels do not count (none; VOC, DAVIS: 255)",
    )
    command.add_argument(
        "--background",
        type=seed_number,
        metavar="ID",
        help="true value that is background beside 0 (none; the table of UOIS and OCID: 1)",
    )
    command.add_argument(
        "--predicted-background", type=seed_number, metavar="ID", help="the same of the predicted masks (none)"
    )


def add_bench_options(command: argparse.ArgumentParser) -> None:
    """Of which scene, and what is measured."""
    add_scenario(command)
    command.add_argument(
        "--seed", type=seed_number, default=0, metavar="N", help="draws the scene and the noise (0)"
    )
    command.add_argument("--json", type=Path, metavar="FILE", help="also write all figures")
    instead = command.add_mutually_exclusive_group()
    instead.add_argument(
        "--sweep", action="store_true", help="measure other sizes of image and numbers of objects instead"
    )
    instead.add_argument(
        "--run", action="store_true", help="measure instead where the time of a whole simulated run goes"
    )
    instead.add_argument(
        "--stream",
        type=positive,
        metavar="SECONDS",
        help="measure instead how evenly commands for a real arm are sent beside the segmentation",
    )
    instead.add_argument(
        "--view", action="store_true", help="measure instead what the live view in the browser costs"
    )
    instead.add_argument(
        "--stops", action="store_true", help="measure instead how soon a moving arm stands still, over LCM"
    )
    instead.add_argument(
        "--driver", action="store_true", help="measure a cycle of `riseg drive-arm` instead, without an arm"
    )
    instead.add_argument("--raft", action="store_true", help="measure RAFT instead, small and large")
    instead.add_argument(
        "--sam", action="store_true", help="measure Segment Anything instead, and the frames beside it"
    )
