"""What the images show: things that move too far, fill the image, or have no depth."""

from collections.abc import Sequence

import cv2
import numpy as np

from riseg_drake.geometry.camera import bounding_region
from riseg_drake.plausibility.limits import PlausibilityLimits
from riseg_drake.plausibility.views import View

_SMALLEST = 64
"""Pixels of a thing that is looked for in the next image."""
_FOUND, _GONE = 0.8, 0.5
"""Correlation at which a thing is found, and below which it is no longer where it was."""
_DEEP = (0.01, 0.3)
"""m below the plane where the true table is, if the plane is the top of something."""


def doubts_about_jumps(pairs: Sequence[tuple[View, View]], limits: PlausibilityLimits) -> list[str]:
    """Whether things move too far between consecutive frames."""
    longest = max((_longest_jump(*pair) for pair in pairs), default=0.0)
    if not pairs or longest <= limits.jump * pairs[0][0].frame.intrinsics.width:
        return []
    share = longest / pairs[0][0].frame.intrinsics.width
    return [
        f"things jump by {share:.0%} of the image's width between two frames, and flow follows "
        f"{limits.jump:.0%}; record more frames a second, or move slower"
    ]


def _longest_jump(first: View, second: View) -> float:
    """Pixels by which the thing moved that moved farthest."""
    if first.above is None:
        return 0.0
    number, labels, stats, _ = cv2.connectedComponentsWithStats(first.above.mask.astype(np.uint8))
    gray_0, gray_1 = (cv2.cvtColor(view.frame.color, cv2.COLOR_RGB2GRAY) for view in (first, second))
    robot = first.frame.robot | second.frame.robot
    longest = 0.0
    for label in range(1, number):
        if not _SMALLEST <= stats[label, cv2.CC_STAT_AREA] <= 0.1 * gray_0.size:
            continue
        rows, columns = bounding_region(labels == label)
        patch = gray_0[rows, columns]
        if robot[rows, columns].any() or patch.std() < 8 or min(patch.shape) < 6:
            continue
        match = cv2.matchTemplate(gray_1, patch, cv2.TM_CCOEFF_NORMED)
        _, best, _, (u, v) = cv2.minMaxLoc(match)
        if best > _FOUND and match[rows.start, columns.start] < _GONE:
            longest = max(longest, float(np.hypot(u - columns.start, v - rows.start)))
    return longest


def doubts_about_content(views: Sequence[View], limits: PlausibilityLimits) -> list[str]:
    """Whether a thing fills the image, and whether there is depth at all."""
    doubts = []
    hollow = float(np.median([np.mean((v.frame.depth == 0)[~v.frame.robot]) for v in views]))
    if hollow > limits.hollow:
        doubts.append(
            f"{hollow:.0%} of the image has no depth (median): things without depth are not found; is the "
            "camera too near, or are things black, shiny or of glass?"
        )
    filled = [_filled(view) for view in views if view.above is not None]
    if filled and float(np.median(filled)) > limits.filled:
        doubts.append(
            f"one thing fills {np.median(filled):.0%} of the image: too little of the table is seen to "
            "tell what moves on it; take the camera farther away"
        )
    return doubts


def _filled(view: View) -> float:
    """Share of an image that its largest thing takes; the plane itself, where the table shows below it."""
    assert view.above is not None
    mask = view.above.mask
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    largest = float(stats[1:, cv2.CC_STAT_AREA].max()) / mask.size if mask.any() else 0.0
    with np.errstate(invalid="ignore"):
        below = (view.above.height < -_DEEP[0]) & (view.above.height > -_DEEP[1])
    if below[~view.frame.robot].mean() > 0.15:
        largest = max(largest, float(view.table().mean()))
    return largest
