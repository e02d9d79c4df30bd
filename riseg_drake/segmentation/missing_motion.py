"""In motion: what did that do which no group and no known motion explains? One body is asked in each frame."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Immutable
from riseg_drake.segmentation.likelihood import Costs, LikelihoodParameters
from riseg_drake.segmentation.motion_search import Search, SearchProblem

_ASKED = 3
"""Bodies, the likeliest to have moved, that are asked in turn what they did while something moves."""


@dataclass(frozen=True)
class Missed(Immutable):
    """What was missed in a frame in motion so far, since the keyframe: not all of it in one frame."""

    place: int = 0
    """Who is asked next: its place among the bodies that are likeliest to have moved."""
    slight_K: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 4, 4)))
    """[S, 4, 4], what was found to have moved by less than counts, seen from the keyframe's camera."""


def missing_motion(
    problem: SearchProblem, known_K: NDArray[np.float64], so_far: Missed
) -> tuple[NDArray[np.float64], Missed]:
    """The one motion [0 or 1, 4, 4] that is missed most beside standing still and known ones [G, 4, 4].

    For a frame in motion, of which there are many: one body is asked about, another one in each frame until one
    has moved, with few points, and the best valley alone is gone down. The motion must explain most of what is
    missed there, `gain_min` nats at least.
    """
    keyframe, parameters, likelihood = problem.compared.keyframe, problem.parameters, problem.likelihood
    gain_min, nothing = problem.gain_min, np.empty((0, 4, 4))
    # What moves less far than the grid's step will be seen at the next rest; poses err by as much.
    least = parameters.step * keyframe.pixels_per_metre
    quick = replace(parameters, best=1, samples=parameters.samples // 3, same_flow=least)
    search = Search(replace(problem, parameters=quick), known_K)
    for motion_K in so_far.slight_K:
        search.costs = search.costs.with_motion(search.costs_of(motion_K))
    bodies = problem.possible_bodies()
    missed = _missed(bodies, search.costs, likelihood)
    for _ in range(so_far.place + 1):
        if not len(bodies):
            return nothing, replace(so_far, place=0)
        # More than a motion's price, for its size: not a sliver, and not a heap of which one thing moves.
        worst = int(((missed - gain_min) / (bodies @ keyframe.area)).argmax())
        body, missed_there = bodies[worst], missed[worst]
        if 2 * missed_there < gain_min:
            return nothing, replace(so_far, place=0)
        # What it is a part of, or a part of it, may have moved with it.
        other = 2 * ((bodies & body) @ keyframe.area) <= (bodies | body) @ keyframe.area
        bodies, missed = bodies[other], missed[other]
    motion = search.best_motion(body, np.where(body, 0.0, np.inf))
    if motion is not None:
        explained = search.costs.with_motion(motion[2])
        if 2 * _missed(body[None], explained, likelihood)[0] < missed_there:
            if search.take(motion, body):
                return motion[1][None], replace(so_far, place=0)
            slight_K = np.concatenate([so_far.slight_K, motion[1][None]])[-_ASKED:]
            return nothing, replace(so_far, slight_K=slight_K)
    return nothing, replace(so_far, place=(so_far.place + 1) % _ASKED)


def _missed(bodies: NDArray[np.bool_], costs: Costs, parameters: LikelihoodParameters) -> NDArray[np.float64]:
    """[B], nats by which the best motion of each of bodies [B, N] falls short of one that is right."""
    missed: NDArray[np.float64] = (bodies @ costs.excess(parameters).T).min(1)
    return missed
