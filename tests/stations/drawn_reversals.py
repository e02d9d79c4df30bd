"""Do masks turn back? What one push wrongly cut in two and a second moves as one; two things that go as one,
then each for itself.

python -m tests.stations.drawn_reversals split
python -m tests.stations.drawn_reversals merged --cases 40 --seed 100

Things in given poses before the simulated camera with all its errors: no arm, no physics. Every cut is one that
a push has really made: of all things drawn, those count that it left in two.
"""

import argparse
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RotationMatrix

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.segmentation.algorithm import SegmentObjsParameters, no_frame_segmented, segment_objs
from riseg_drake.segmentation.optical_flow import DisFlow
from riseg_drake.stations.filmed_world import FilmedWorld
from riseg_drake.stations.footprint import travel
from riseg_drake.stations.object_models import ObjectModel, find_models
from riseg_drake.stations.placed_object import PlacedObject
from riseg_drake.stations.sensor_noise import every_depth_error
from riseg_drake.stations.wrist_camera import CameraConfig

FOLDERS = ["package://riseg_drake_models/objects", "package://riseg_drake_models/household"]
MIDDLE = np.array([0.51, 0.0])
PLACES = [MIDDLE + np.array([x, y]) for x in (-0.09, 0.09) for y in (-0.11, 0.11)]
"""m, on the table, so far apart that nothing meets."""
DISTANCE = 0.55
"""m from the camera, which looks straight down, to the table."""
PUSHING = np.array([0.03, 0.02, -0.12])
"""m by which a camera on the arm is elsewhere amid a push."""
FRAMES, REST = 8, 10
"""Frames that a motion takes, and that follow it at rest."""
FAR, TURN = (0.01, 0.03), 0.35
"""m that a thing goes, and rad that it turns at most."""
PART = 0.1
"""Share of a thing's pixels from which on an id counts as on it."""
POSE_TURN, POSE_SHIFT = 1e-4, 5e-5
"""rad and m, standard deviations of the pose of a camera on an arm that stands, by its joint angles."""


class Table:
    """Things on a table that go where they are put, and Alg. 2, which watches."""

    def __init__(
        self, models: Sequence[ObjectModel], seed: int, parameters: SegmentObjsParameters | None = None
    ) -> None:
        """With things of some models; the seed draws noise and body frames."""
        self._parameters = parameters or SegmentObjsParameters()
        self._camera = CameraConfig(noise=every_depth_error())
        self._things, self._seed = len(models), seed
        self._world = FilmedWorld(self._camera, seed, [PlacedObject(model, model.X_WB) for model in models])
        self._rng = np.random.default_rng([seed, 1])
        self._seen = no_frame_segmented(self._camera.intrinsics.shape)
        self._label = np.zeros(self._camera.intrinsics.shape, np.uint16)
        self._frames = 0

    def watch(self, X_WBs: Sequence[RigidTransform], frames: int = 1, share: float = 0.0) -> None:
        """Let Alg. 2 see the things so, for some frames, from a `share` of the way to where pushes are made."""
        self._world.put(X_WBs)
        p_WC = np.array([*MIDDLE, DISTANCE]) + share * PUSHING
        X_WC = RigidTransform(RotationMatrix(np.diag([1.0, -1.0, -1.0])), p_WC)
        sigma = np.repeat([POSE_TURN, POSE_SHIFT], 3)
        for _ in range(frames):
            color, depth, self._label = self._world.look(X_WC, self._rng)
            frame = Frame(
                sequence=self._frames,
                time=self._frames / 15.0,
                intrinsics=self._camera.intrinsics,
                color=color,
                depth=depth,
                X_WC=X_WC.GetAsMatrix4() @ exp_se3(sigma * self._rng.normal(size=6)),
                robot=np.zeros(depth.shape, bool),
            )
            self._seen = segment_objs(self._seen, frame, DisFlow(), self._parameters, self._seed)
            self._frames += 1

    def ids(self) -> list[dict[int, float]]:
        """For each thing the ids on it, and the share of its pixels that each has."""
        found = []
        for i in range(1, self._things + 1):
            on = self._seen.mask[self._label == i]
            ids, pixels = np.unique(on[on > 0], return_counts=True)
            shares = pixels / max(len(on), 1)
            found.append({int(a): float(s) for a, s in zip(ids, shares, strict=True) if s >= PART})
        return found


def on_the_way(
    start: Sequence[RigidTransform], end: Sequence[RigidTransform], frames: int
) -> Iterator[list[RigidTransform]]:
    """Poses between two, a frame after the other, the last one at the end."""
    for k in range(1, frames + 1):
        yield [_between(a, b, k / frames) for a, b in zip(start, end, strict=True)]


def _between(a: RigidTransform, b: RigidTransform, share: float) -> RigidTransform:
    turn = b.rotation().multiply(a.rotation().inverse()).ToAngleAxis()
    R = RotationMatrix(AngleAxis(turn.angle() * share, turn.axis()))
    p = (1 - share) * a.translation() + share * b.translation()
    return RigidTransform(R.multiply(a.rotation()), p)


def drawn_motion(rng: np.random.Generator) -> tuple[float, NDArray[np.float64]]:
    """How a push moves a thing: a turn, rad, and a way on the table [2], m."""
    heading, far = rng.uniform(-np.pi, np.pi), rng.uniform(*FAR)
    return rng.uniform(-TURN, TURN), far * np.array([np.cos(heading), np.sin(heading)])


def moved(X_WB: RigidTransform, turn: float, way: NDArray, about: NDArray | None = None) -> RigidTransform:
    """A thing turned about a vertical through a point [2], its own middle if None, and moved along the
    table."""
    p = X_WB.translation()
    middle = p[:2] if about is None else about
    R = RotationMatrix.MakeZRotation(turn)
    xy = middle + (R.matrix()[:2, :2] @ (p[:2] - middle)) + way
    return RigidTransform(R.multiply(X_WB.rotation()), [*xy, p[2]])


def go(table: Table, start: Sequence[RigidTransform], end: Sequence[RigidTransform]) -> None:
    """From one rest to the next."""
    for k, X_WBs in enumerate(on_the_way(start, end, FRAMES), 1):
        table.watch(X_WBs, share=np.sin(np.pi * k / FRAMES))
    table.watch(end, REST)


def standing(model: ObjectModel, place: NDArray, yaw: float) -> RigidTransform:
    """A model on the table."""
    R = RotationMatrix.MakeZRotation(yaw).multiply(model.X_WB.rotation())
    lowest = (R.matrix() @ model.corners.T)[2].min()
    return RigidTransform(R, [*place, -lowest])


def split(seed: int, models: Sequence[ObjectModel]) -> list[tuple[str, bool]]:
    """Four things pushed twice: of those that the first push left in two the name, and whether they are one
    now."""
    rng = np.random.default_rng([seed, 0])
    chosen = [models[i] for i in rng.permutation(len(models))[: len(PLACES)]]
    table = Table(chosen, seed)
    start = [standing(m, p, rng.uniform(-np.pi, np.pi)) for m, p in zip(chosen, PLACES, strict=True)]
    first = [moved(X, *drawn_motion(rng)) for X in start]
    second = [moved(X, *drawn_motion(rng)) for X in first]
    table.watch(start, REST)
    go(table, start, first)
    cut = [i for i, ids in enumerate(table.ids()) if len(ids) > 1]
    if not cut:
        return []
    go(table, first, second)
    after = table.ids()
    return [(chosen[i].name, len(after[i]) == 1) for i in cut]


def merged(
    seed: int, models: Sequence[ObjectModel], parameters: SegmentObjsParameters | None = None
) -> list[tuple[str, bool]]:
    """Two things side by side, pushed as one, then each for itself: their names, and whether they are two now.

    Empty where the first push did not make them one.
    """
    rng = np.random.default_rng([seed, 0])
    one, other = (models[i] for i in rng.permutation(len(models))[:2])
    middle = MIDDLE
    turns, heading = rng.uniform(-np.pi, np.pi, 2), rng.uniform(-np.pi, np.pi)
    u = np.array([np.cos(heading), np.sin(heading)])
    away = travel(other.footprint.moved(turns[1], middle + u), one.footprint.moved(turns[0], middle), -u)
    if not np.isfinite(away):
        return []
    start = [standing(one, middle, turns[0]), standing(other, middle + (1 - away + 3e-4) * u, turns[1])]
    between = np.mean([X.translation()[:2] for X in start], axis=0)
    shift = middle - between
    start = [moved(X, 0.0, shift) for X in start]
    table = Table([one, other], seed, parameters)
    turn, way = drawn_motion(rng)
    first = [moved(X, turn, way, middle) for X in start]
    apart = [turn + rng.uniform(-TURN, TURN) for _ in range(2)]
    v = RotationMatrix.MakeZRotation(turn).matrix()[:2, :2] @ u
    second = [
        moved(X, angle - turn, sign * rng.uniform(*FAR) * v)
        for X, angle, sign in zip(first, apart, (-1, 1), strict=True)
    ]
    table.watch(start, REST)
    go(table, start, first)
    before = table.ids()
    if len(set(before[0]) | set(before[1])) != 1:
        return []
    go(table, first, second)
    after = table.ids()
    two = all(len(ids) == 1 for ids in after) and set(after[0]) != set(after[1])
    return [(f"{one.name}, {other.name}", two)]


def main() -> int:
    """Draw cases of a kind until there are enough; 0 if 95 in a hundred turn back."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=("split", "merged"))
    parser.add_argument("--cases", type=int, default=40, help="how many (40)")
    parser.add_argument("--seed", type=int, default=0, help="of the first; the others follow (0)")
    parser.add_argument("--most", type=int, default=400, help="so many are drawn at most (400)")
    chosen = parser.parse_args()
    models = find_models(FOLDERS)
    results: list[bool] = []
    drawn = 0
    for seed in range(chosen.seed, chosen.seed + chosen.most):
        drawn += 1
        for name, turned in (split if chosen.kind == "split" else merged)(seed, models):
            results.append(turned)
            print(f"seed {seed}: {name}: {'turned back' if turned else 'NOT turned back'}", flush=True)
        if len(results) >= chosen.cases:
            break
    print(f"{sum(results)} of {len(results)} turned back; {drawn} scenes drawn")
    return 0 if len(results) >= chosen.cases and sum(results) >= 0.95 * len(results) else 1


if __name__ == "__main__":
    raise SystemExit(main())
