"""What line 7 has before it at t: the frame, in few pixels and in all, and what that is compared with."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.plane import transform_plane
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.geometry.se3 import inverse
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.belief import BeliefParameters
from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.frame_pairs import camera_span
from riseg_drake.segmentation.keyframe import Keyframe
from riseg_drake.segmentation.motion_search import MotionSearchParameters
from riseg_drake.segmentation.observation import ObservationParameters
from riseg_drake.segmentation.rest import RestParameters
from riseg_drake.segmentation.scales import SMALLEST_SEEN
from riseg_drake.segmentation.segmentation import Segmentation


@dataclass
class EvidenceParameters:
    """How line 7 is decided by evidence (not in the paper)."""

    rest: RestParameters = field(default_factory=RestParameters)
    observation: ObservationParameters = field(default_factory=ObservationParameters)
    search: MotionSearchParameters = field(default_factory=MotionSearchParameters)
    belief: BeliefParameters = field(default_factory=BeliefParameters)
    settled: float = 2.0
    """Nats a border by which an object's outline must be better than the next best, not to be in doubt."""
    in_view: float = 0.9
    """Share of what the keyframe shows that a picture must show, too, to decide: a rest of the arm just after a
    push sees little."""
    span: float = 15.0
    """Pixels of the whole frame that something has moved since the keyframe, from which what is seen in motion
    decides, too: hands do not rest."""
    creep: float = 4.0
    """Pixels of the whole frame, from one to the next, up to which the camera has nearly come to rest, and sees
    sharply."""
    uncovered: float = 0.3
    """Share of what stands there that the keyframe does not show, from which the view needs another."""
    fresh: float = 0.5
    """Share of a frame in motion in the running mean of their evidence, so that no single one parts a body or
    joins two; 1: each for itself."""
    area_seen: float = SMALLEST_SEEN
    """m^2; a body of which a frame in motion shows less is where it went, and a new one is not shown yet; 0:
    all are as that frame alone has them."""
    search_every: float = 0.13
    """s between two frames in motion in which a motion is looked for that no group proposes: what is blank."""
    memory: bool = True
    """Remember objects that leave the view (not in the paper)."""


@dataclass(frozen=True)
class Look:
    """What Alg. 2 sees at t, and by what it judges that."""

    pair: FramePair
    above: AboveTable
    """objMask at t."""
    see_whole: Callable[[], AboveTable]
    """ObjMask at t of the whole frame, worked out where it is asked for."""
    parameters: EvidenceParameters
    bfif: BFIFParameters

    @property
    def frame(self) -> Frame:
        """I_t."""
        return self.pair.current

    @cached_property
    def whole_above(self) -> AboveTable:
        """ObjMask at t of the whole frame."""
        return self.see_whole()


def agreeing(look: Look, poses: Mapping[int, NDArray[np.float64]]) -> Look:
    """The same with poses that agree with the reference's own `poses` [4, 4], by frame number, as far as known.

    Poses that err are set right within a pair (`camera_motion`), whose reference has the pose it came with,
    and errs with that against the keyframe. The pose that was set right when it was new does not. Poses that
    are exact, with a residual of 0, agree as they are.
    """
    reference, current = look.pair.reference, look.pair.current
    X_WC0 = poses.get(reference.sequence)
    if X_WC0 is None or look.pair.residual == 0 or np.array_equal(X_WC0, reference.X_WC):
        return look
    X_AW = X_WC0 @ inverse(reference.X_WC)  # from the world as it came to the one that agrees

    def moved(above: AboveTable) -> AboveTable:
        return replace(above, plane_W=transform_plane(X_AW, above.plane_W))

    pair = replace(
        look.pair,
        reference=replace(reference, X_WC=X_WC0),
        current=replace(current, X_WC=X_AW @ current.X_WC),
    )
    return replace(look, pair=pair, above=moved(look.above), see_whole=lambda: moved(look.see_whole()))


def compared_in_motion(now: Segmentation, look: Look) -> Comparison:
    """With the keyframe as it was, or as it was seen again, whichever is more like this frame's view."""
    nearest = min(now.views, key=lambda view: camera_span(view.frame, look.frame))
    return _compared(now, nearest, look.frame, look.above, look)


def compared_at_rest(now: Segmentation, look: Look) -> Comparison:
    """With the keyframe, in all pixels."""
    assert now.belief is not None
    return _compared(now, now.belief.keyframe, look.frame.whole, look.whole_above, look)


def _compared(now: Segmentation, keyframe: Keyframe, frame: Frame, above: AboveTable, look: Look) -> Comparison:
    assert now.belief is not None
    return Comparison(
        keyframe,
        frame,
        depth_noise=max(above.depth_noise, keyframe.above.depth_noise),
        view_error=now.view_error.share(look.parameters.observation.likelihood.view_error),
        pose_error=look.pair.pose_error,
        body=now.belief.body,
    )
