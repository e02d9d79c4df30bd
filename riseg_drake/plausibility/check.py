"""All that is asked of a recording before it is worked on."""

from collections.abc import Callable, Sequence

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.plausibility.limits import PlausibilityLimits
from riseg_drake.plausibility.poses import doubts_about_poses, seen_pair
from riseg_drake.plausibility.registration import doubts_about_registration
from riseg_drake.plausibility.scale import doubts_about_distance, doubts_about_scale
from riseg_drake.plausibility.scene import doubts_about_content, doubts_about_jumps
from riseg_drake.plausibility.views import View, small_view

_MOMENTS = 6
"""So many, spread over the recording, are looked at."""
_APART = 4
"""Frames apart are the two of a pair: what moves slowly has moved then."""

ReadFrame = Callable[[int], Frame | None]
"""Reads the frame with that number; None where it is damaged."""


def doubts(
    read: ReadFrame,
    count: int,
    depth_scale: float | None,
    poses: str | None,
    limits: PlausibilityLimits | None = None,
) -> list[str]:
    """What of a recording cannot be, or can hardly be: a line each, with what was measured and what is right.

    Args:
        read: reads one of its frames.
        count: how many frames there are.
        depth_scale: units of depth per metre as the recording says; None where depth comes in metres.
        poses: where the camera's poses come from; None where it is said to stand still.
        limits: the defaults if None.
    """
    limits = limits or PlausibilityLimits()
    if count < 2:
        frame = read(0) if count else None
        return [
            "there is one frame only: what moved is told from two; record more of them",
            *doubts_about_distance([] if frame is None else [frame.depth]),
        ]
    numbers = _moments(count)
    read_before: dict[int, View | None] = {}

    def view(number: int) -> View | None:
        if number not in read_before:
            frame = read(number)
            read_before[number] = None if frame is None else small_view(frame, limits.width)
        return read_before[number]

    views = [seen for number in numbers if (seen := view(number)) is not None]
    if not views:
        return []
    near, far = ([(view(n), view(min(n + apart, count - 1))) for n in numbers] for apart in (1, _APART))
    pairs = [pair for a, b in far if a and b and (pair := seen_pair(a, b)) is not None]
    frame = read(numbers[0])
    pixels = frame.intrinsics.width / views[0].frame.intrinsics.width if frame else 1.0
    frames = [view.frame for view in views]
    scale = [] if depth_scale is None else doubts_about_scale(views, depth_scale, limits)
    return [
        *(scale or doubts_about_distance([frame.depth for frame in frames])),
        *doubts_about_registration(frames, pixels, limits),
        *doubts_about_poses(pairs, poses, limits, pixels),
        *doubts_about_jumps([(a, b) for a, b in near if a and b], limits),
        *doubts_about_content(views, limits),
    ]


def looked_at(count: int) -> list[int]:
    """The numbers of the frames that `doubts` reads of so many, for who must read them one after the other."""
    if count < 2:
        return list(range(count))
    return sorted({min(n + apart, count - 1) for n in _moments(count) for apart in (0, 1, _APART)})


def _moments(count: int) -> Sequence[int]:
    """Numbers of frames spread over a recording, each with others after it."""
    last = max(count - 1 - _APART, min(count - 2, _MOMENTS - 1))
    return sorted({round(k * last / (_MOMENTS - 1)) for k in range(_MOMENTS)})
