"""From rest to rest: how did that move which no known motion explains? Looked for, not tracked.

Things that are pushed over a table slide and turn on it, or roll: three numbers, and a push is short. So all
of them are tried on a grid, for a small patch of what is not explained, which mostly lies on one body; the best
few are sharpened, on ever more of what they explain. A patch of a blank thing tells little: so the same is done
with all of what may be one body, whose outline and height tell.
"""

from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter

from riseg_drake.geometry.camera import rays
from riseg_drake.segmentation.above_table import AboveTable
from riseg_drake.segmentation.alignment import AlignmentParameters, rigid_fit
from riseg_drake.segmentation.comparison import Comparison
from riseg_drake.segmentation.likelihood import (
    Costs,
    LikelihoodParameters,
    motion_costs,
    unexplained_parts,
)
from riseg_drake.segmentation.motions import flow_difference
from riseg_drake.segmentation.recognition import RecognitionParameters, recognised_motions
from riseg_drake.segmentation.rolls import rolling_axes, rolls, surface_normals
from riseg_drake.segmentation.slides import SlideCosts, slides
from riseg_drake.segmentation.superpixels import label_middles


@dataclass
class MotionSearchParameters:
    """What is tried, and what is enough."""

    reach: float = 0.044
    """m; the farthest shift along each axis of the table."""
    step: float = 0.004
    """m, between two shifts: some pixels, within which a motion is sharpened."""
    turn: float = 0.56
    """rad; the largest turn."""
    roll: float = 0.84
    """rad; the farthest roll of what is round, in as many steps: most of what was seen is in sight still. 0:
    nothing rolls."""
    turn_step: float = 0.14
    """rad, between two turns: a step at the rim of a patch."""
    patch: float = 0.022
    """m; radius of the patches."""
    samples: int = 160
    """Points of a patch that are asked."""
    blur: float = 3.0
    """Pixels; both images are blurred so much that a step of the grid leads into the right valley."""
    best: int = 4
    """Valleys that are gone down."""
    unexplained: float = 3.0
    """Mean squared residuals from which a superpixel is not explained."""
    same_flow: float = 1.0
    """Pixels (root mean square) within which two motions are one, and what moves stands still."""
    rounds: int = 24
    """Patches that are tried at most."""
    recognition: RecognitionParameters = field(default_factory=RecognitionParameters)
    alignment: AlignmentParameters = field(
        default_factory=lambda: AlignmentParameters(rounds=5, turn=0.1, shift=0.01)
    )


_RING = np.ones((13, 13), np.uint8)
"""Six pixels around an outline are looked at: what was free there is free where it went."""
_EDGES_MIN = 25
"""Pixels with a gradient that it takes to sharpen a motion."""
_BETTER = 0.3
"""Mean squared residuals by which a motion must explain a superpixel better for that to be its own."""
_GROWTH = (1.0, 1.4, 4.0, 50.0)
"""Radii, in those of a patch, within which a motion is sharpened in turn."""


@dataclass(frozen=True)
class SearchProblem:
    """A frame in which motions of a keyframe's bodies are looked for."""

    compared: Comparison
    """The keyframe, at the rest before, and the frame."""
    above: AboveTable
    """objMask of that frame."""
    divisions: NDArray[np.intp]
    """[L, N], 0.., ways to tell which superpixels are one body."""
    gain_min: float
    """Nats that a motion must bring."""
    parameters: MotionSearchParameters
    likelihood: LikelihoodParameters
    area_min: float
    """m^2; what is large enough for a body."""

    def possible_bodies(self) -> NDArray[np.bool_]:
        """[B, N], the parts of all divisions that are as large as a body, each once."""
        area, each = self.compared.keyframe.area, {}
        for part in self.divisions:
            for p in np.flatnonzero(np.bincount(part, area) >= self.pixels_min):
                body = part == p
                each[body.tobytes()] = body
        return np.array([each[key] for key in sorted(each)], bool).reshape(-1, len(area))

    @property
    def pixels_min(self) -> float:
        """Pixels of what is large enough for a body."""
        return self.area_min * self.compared.keyframe.pixels_per_metre**2


def search_motions(problem: SearchProblem, proposed_K: NDArray[np.float64]) -> NDArray[np.float64]:
    """Motions [C, 4, 4] in the keyframe's camera that explain, from rest to rest, what standing still does not.

    Those `proposed_K` [G, 4, 4], seen in motion, are taken where they explain what nothing found does.
    """
    keyframe, parameters, likelihood = problem.compared.keyframe, problem.parameters, problem.likelihood
    search = Search(problem, np.empty((0, 4, 4)))
    for motion in recognised_motions(problem.compared, problem.above.mask, parameters.recognition):
        search.take(search.sharpened(motion), np.zeros(keyframe.count, bool))
    asked = search.costs.point_count > likelihood.correlated_gray
    tried = np.zeros(keyframe.count, bool)
    for _ in range(parameters.rounds):
        unexplained = (search.costs.misfit.min(0) > parameters.unexplained) & asked
        patch, distance = search.densest_patch(unexplained & ~tried)
        if keyframe.area[patch].sum() < 0.2 * problem.pixels_min:
            break
        tried |= patch & unexplained
        if search.take(search.best_motion(patch, distance), patch):
            # What it did not explain may be tried with other neighbours.
            tried &= search.costs.misfit.min(0) > parameters.unexplained
    # Each superpixel of a blank body may be explained, by one motion or another, all of it by none.
    bodies = problem.possible_bodies()
    while len(bodies):
        short = (bodies @ search.costs.nats(likelihood).T).min(1)
        worst = int(short.argmax())
        if short[worst] < problem.gain_min:
            break
        body, bodies = bodies[worst], np.delete(bodies, worst, axis=0)
        search.take(search.best_motion(body, np.where(body, 0.0, np.inf)), body, distinct=False)
    for motion in proposed_K:
        search.take(search.sharpened(motion), np.zeros(keyframe.count, bool))
    return np.array(search.found).reshape(-1, 4, 4)


class Search:
    """A keyframe and a frame, prepared for many motions, and those that were found."""

    def __init__(self, problem: SearchProblem, known_K: NDArray[np.float64]):
        """Known are standing still and some motions [G, 4, 4]."""
        compared = self._compared = problem.compared
        self._keyframe, self._frame = compared.keyframe, compared.frame
        self._above, self._divisions, self._gain_min = problem.above, problem.divisions, problem.gain_min
        self._parameters, self._likelihood = problem.parameters, problem.likelihood
        self._fit = rigid_fit(compared.pair, compared.depth_noise)
        self._rng = np.random.default_rng(compared.keyframe.frame.sequence)
        self._normal = compared.keyframe.plane_K[:3]
        self.found: list[NDArray] = list(known_K)
        """Motions [4, 4]."""
        self.costs = motion_costs(compared, np.concatenate([np.eye(4)[None], known_K]), problem.likelihood)
        """Of standing still, and of those."""

    # In motion most looks end with the costs above: what follows is made when it is asked for.

    @cached_property
    def _slides(self) -> SlideCosts:
        return SlideCosts(
            self._compared, self._above.mask, self._parameters.blur, self._likelihood.residual_max
        )

    @cached_property
    def _middle(self) -> NDArray[np.float64]:
        """[N, 2], m, of each superpixel, about."""
        keyframe = self._keyframe
        label = keyframe.image_of(np.arange(keyframe.count), -1)
        return label_middles(label, keyframe.count) / keyframe.pixels_per_metre

    def take(
        self, motion: tuple[float, NDArray, Costs] | None, patch: NDArray[np.bool_], *, distinct: bool = True
    ) -> bool:
        """Add a motion [4, 4], with its gain, nats, and its costs, if it is worth it and takes a patch [N]
        elsewhere than standing still and the others do, where it is to be `distinct`."""
        if motion is None or motion[0] < self._gain_min or (distinct and not self._differs(motion[1], patch)):
            return False
        self.found.append(motion[1])
        self.costs = self.costs.with_motion(motion[2])
        return True

    def densest_patch(self, among: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
        """Of some superpixels [N] those around where most of them lie, and the distance [N] from there, m."""
        index = np.flatnonzero(among)
        if not len(index):
            return among, np.full(len(among), np.inf)
        middle, area = self._middle[index], self._keyframe.area[index]
        squared = ((middle[:, None] - middle[None]) ** 2).sum(-1)
        mass = np.exp(-squared / (0.55 * self._parameters.patch) ** 2) @ area
        distance = np.linalg.norm(self._middle - middle[mass.argmax()], axis=1)
        return among & (distance < self._parameters.patch), distance

    def best_motion(
        self, patch: NDArray[np.bool_], distance: NDArray[np.float64]
    ) -> tuple[float, NDArray, Costs] | None:
        """What a patch [N] did: the gain, nats, the motion [4, 4], and its costs."""
        blank = not np.isfinite(distance).all()
        samples = self._parameters.samples * (3 if blank else 1)
        results = []
        for start in self._valleys(patch, samples):
            ends = [self._fitted_to(patch, start)] if blank else self._grown(patch, distance, start)
            for motion in ends:
                own = self.costs_of(motion)
                results.append((self._gain(own), motion, own))
        # Gains end where noise begins; among those that are alike the patch itself tells.
        weight = self.costs.point_count * patch / (2 * self._likelihood.correlated_gray)
        return max(results, key=lambda r: r[0] - float(weight @ r[2].misfit[0]), default=None)

    def _fitted_to(self, patch: NDArray[np.bool_], motion: NDArray) -> NDArray:
        """A motion [4, 4] sharpened on all of a patch [N], which is one body whatever explains its parts."""
        for _ in _GROWTH:
            fitted = self._fitted(motion, patch)
            if fitted is None:
                break
            motion = fitted
        return motion

    def _grown(self, patch: NDArray[np.bool_], distance: NDArray[np.float64], start: NDArray) -> list[NDArray]:
        """A motion [4, 4] sharpened on a patch [N] and then on ever more of what it explains around, within a
        distance [N], m; or explains better than what is known does, so that there are two answers."""
        best_known, ends = self.costs.misfit.min(0), []
        for better_by in (_BETTER, -np.inf):
            motion = start
            for radius in _GROWTH:
                mine = self.costs_of(motion).misfit[0]
                explained = (mine < self._parameters.unexplained + 1) & (mine < best_known - better_by)
                if radius == _GROWTH[0]:
                    explained |= patch
                fitted = self._fitted(motion, explained & (distance < radius * self._parameters.patch))
                if fitted is None:
                    break
                motion = fitted
            ends.append(motion)
        return ends

    def _differs(self, motion: NDArray, patch: NDArray[np.bool_]) -> bool:
        """Whether a motion takes a patch elsewhere than standing still and what was found [4, 4] do."""
        p_KQ = self._keyframe.edges.p_C0Q
        mine = p_KQ[patch[self._keyframe.edges.piece]]
        p_KQ, focal_length = mine if len(mine) else p_KQ, self._frame.intrinsics.fx
        return all(
            flow_difference(p_KQ, motion, X, focal_length) > self._parameters.same_flow
            for X in (np.eye(4), *self.found)
        )

    def sharpened(self, motion: NDArray) -> tuple[float, NDArray, Costs]:
        """A proposed motion [4, 4], made to fit what it explains: the gain, nats, the motion, and its costs."""
        mine = self.costs_of(motion).misfit[0]
        better = (mine < self._parameters.unexplained + 1) & (mine < self.costs.misfit.min(0) - _BETTER)
        fitted = self._fitted(motion, better)
        motion = motion if fitted is None else fitted
        own = self.costs_of(motion)
        return self._gain(own), motion, own

    def _fitted(self, motion: NDArray, members: NDArray[np.bool_]) -> NDArray | None:
        """A motion [4, 4] sharpened on the edges of some superpixels [N]; None where they have too few."""
        edges = np.flatnonzero(members[self._keyframe.edges.piece])
        if len(edges) < _EDGES_MIN:
            return None
        alignment = self._parameters.alignment
        return self._fit.align(self._keyframe.edges.subset(edges), motion, alignment.rounds, alignment)

    def _gain(self, own: Costs) -> float:
        """Nats by which a motion explains a part better, or superpixels wherever they are."""
        nats = self.costs.with_motion(own).nats(self._likelihood)
        better = np.clip(nats[:-1].min(0) - nats[-1], 0, None)
        of_parts = [
            (unexplained_parts(nats[:-1], part) - unexplained_parts(nats, part)).max(initial=0)
            for part in self._divisions
        ]
        return float(max(better[own.misfit[0] < self._parameters.unexplained + 1].sum(), *of_parts))

    def costs_of(self, motion: NDArray) -> Costs:
        """How badly a motion [4, 4] explains each superpixel."""
        return motion_costs(self._compared, motion[None], self._likelihood)

    def _valleys(self, patch: NDArray[np.bool_], samples: int) -> list[NDArray]:
        """The best motions [4, 4] on the grids of slides and turns, and of rolls where they are round."""
        parameters, keyframe = self._parameters, self._keyframe
        point = np.flatnonzero(patch[keyframe.owner])
        if len(point) < parameters.samples // 3:
            return []
        point = np.sort(self._rng.permutation(point)[:samples])
        v, u = keyframe.points.pixel[:, point]
        p_KQ = rays(self._frame.intrinsics)[v, u] * keyframe.points.depth[point, None]
        beside = self._beside(patch, p_KQ, samples // 2)
        shifts = np.arange(-parameters.reach, parameters.reach + 1e-9, parameters.step)
        turns = np.arange(-parameters.turn, parameters.turn + 1e-9, parameters.turn_step)
        grid = np.stack(np.meshgrid(shifts, shifts, turns, indexing="ij"), axis=-1)
        amounts = grid.reshape(-1, 3)
        grids = [slides(self._normal, p_KQ.mean(0), amounts)]
        axes = []
        if parameters.roll:
            normals = surface_normals(keyframe.frame, keyframe.image_of(patch), v, u)
            axes = rolling_axes(p_KQ, normals, self._normal)
        grids += [
            rolls(axis, self._normal, amounts * [1, 1, parameters.roll / parameters.turn]) for axis in axes
        ]
        valleys = []
        for k, motions in enumerate(grids):
            cost = self._slides.of(p_KQ, v, u, motions, lit_anew=k > 0)
            if len(beside):
                cost += self._slides.taken(beside, motions)
            lowest = np.flatnonzero(cost == minimum_filter(cost.reshape(grid.shape[:3]), 5).ravel())
            valleys += [(cost[n], motions[n]) for n in lowest]
        return [motion for _, motion in sorted(valleys, key=lambda valley: valley[0])[: parameters.best]]

    def _beside(self, patch: NDArray[np.bool_], p_KQ: NDArray, samples: int) -> NDArray[np.float64]:
        """Points [S, 3] at a patch's height in the free space beside it, which moves with it."""
        keyframe = self._keyframe
        own = keyframe.image_of(patch).view(np.uint8)
        ring = cv2.dilate(own, _RING) & ~cv2.dilate(
            keyframe.above.mask.view(np.uint8), np.ones((3, 3), np.uint8)
        )
        v, u = np.nonzero(ring & (keyframe.frame.depth > 0))
        some = np.sort(self._rng.permutation(len(v))[:samples])
        n = self._normal / np.linalg.norm(self._normal)
        r = rays(self._frame.intrinsics)[v[some], u[some]]
        return r * (np.median(p_KQ @ n) / (r @ n))[:, None]
