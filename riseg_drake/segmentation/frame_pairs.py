"""Which frame is t-1? The pair (t-1, t) should span some pixels of motion, whatever the camera's rate.

At half a pixel the relative error of flow is three times what it is at three pixels, and two motions
that differ little are told apart only when both have gone some way. So the reference frame stays while
things move, and is renewed when the pair spans enough, or when nothing moves and the camera goes on.
"""

from dataclasses import dataclass, field

import numpy as np

from riseg_drake.geometry.rgbd import NO_PAIR, Frame, FramePair

_SAME_TIME = 1e-3
"""s; stamps are rounded."""


@dataclass
class FramePairParameters:
    """How far apart the two frames of a pair may be."""

    kind: str = field(default="motion", metadata={"choices": ("motion", "consecutive")})
    """"motion" or, as in the paper, "consecutive"."""
    step: float = field(default=0.0, metadata={"least": 0.0, "most": 60.0})
    """s between t-1 and t of consecutive pairs, which the paper does not give; 0: each frame with the one
    before it. Frames in between are paired with the t-1 before them."""
    flow_span_share: float = 0.03125
    """Effective flow, as a share of the image's width, after which the reference is renewed: 20 pixels of
    640."""
    width: int = field(default=320, metadata={"least": 0})
    """Pixels; a frame is reduced to as few to a row as are not less, for all but what rests decide. 0: it is
    whole, as in the paper."""
    moving: float = 0.5
    """Effective flow, pixels, from which something moves."""
    camera_span_moving: float = 0.08
    """Shift of the image by the camera's motion, as a share of its width, that is allowed while
    something moves."""
    camera_span_still: float = 0.015
    """The same while nothing moves."""
    age_still: float = 1.0
    """s; while nothing moves the reference is at most that old."""


def next_pair(pair: FramePair, frame: Frame, flow_span: float, parameters: FramePairParameters) -> FramePair:
    """The pair for a new frame.

    Args:
        pair: the pair before, NO_PAIR at the first frame (which is then paired with itself).
        frame: the newest frame.
        flow_span: effective flow found in the pair before, pixels.
        parameters: see there; ValueError for an unknown kind.
    """
    if parameters.kind not in ("motion", "consecutive"):
        raise ValueError(f"no frame pairs {parameters.kind!r}: choose motion or consecutive")
    if pair is NO_PAIR:
        return FramePair(frame, frame)
    if parameters.kind == "consecutive":
        complete = pair.current.time - pair.reference.time >= parameters.step - _SAME_TIME
        return FramePair(pair.current if complete else pair.reference, frame)
    if flow_span >= parameters.moving:
        renew = flow_span > parameters.flow_span_share * frame.intrinsics.width
        share = parameters.camera_span_moving
    else:
        renew = frame.time - pair.reference.time > parameters.age_still
        share = parameters.camera_span_still
    renew |= camera_span(pair.reference, frame) > share * frame.intrinsics.width
    return FramePair(pair.current, frame) if renew else FramePair(pair.reference, frame, span=flow_span)


def camera_span(reference: Frame, current: Frame) -> float:
    """About how many pixels the camera's motion shifts the image between two frames."""
    apart = current.X_WC[:3] - reference.X_WC[:3]
    # The chord of a turn is as long in any frame.
    turn = 2 * np.arcsin(min(1.0, float(np.linalg.norm(apart[:, :3])) / np.sqrt(8)))
    return current.intrinsics.fx * float(np.linalg.norm(apart[:, 3]) / current.typical_depth + turn)
