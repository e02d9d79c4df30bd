"""Is what rolls one thing, and what stands still beside it none?

python -m tests.stations.drawn_rolls --cases 40 --seed 100

Cans and bottles that lie on a table roll by 10 to 45 degrees as they go, two in each scene, beside two cartons
that stand still; before the simulated camera with all its errors (no arm, no physics).
"""

import argparse

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RotationMatrix

from riseg_drake.stations.object_models import ObjectModel, find_models
from tests.stations.drawn_reversals import FOLDERS, PLACES, REST, Table, go, standing

ROUND = ("can_soda_lying", "bottle_water_lying", "bottle_sauce_lying")
STILL = ("carton_tea", "carton_pasta")
ANGLES = np.radians([10.0, 45.0])
MOST = 0.9
"""Of its pixels, which the one id must have."""


def rolled(model: ObjectModel, X_WB: RigidTransform, angle: float) -> RigidTransform:
    """A lying thing that has rolled by an angle, rad, about the axis along it, without slipping."""
    p_WQ = X_WB.rotation().matrix() @ model.corners.T
    xy = p_WQ[:2] - p_WQ[:2].mean(1, keepdims=True)
    axis = np.array([*np.linalg.svd(xy)[0][:, 0], 0.0])
    radius = np.ptp(p_WQ[2]) / 2
    middle = np.array([*X_WB.translation()[:2], radius])
    R = RotationMatrix(AngleAxis(angle, axis))
    way = angle * np.cross(axis, [0, 0, radius])
    return RigidTransform(
        R.multiply(X_WB.rotation()), middle + R.matrix() @ (X_WB.translation() - middle) + way
    )


def outcome(seed: int) -> tuple[list[tuple[str, float, dict[int, float]]], list[str]]:
    """Of each thing that rolled its name, by how many degrees, and the share of each id on it; and the names of
    what stood still and has an id."""
    models = {model.name: model for model in find_models(FOLDERS)}
    rng = np.random.default_rng([seed, 2])
    names = [*map(str, rng.choice(ROUND, 2)), *STILL]
    chosen = [models[name] for name in names]
    start = [standing(m, p, rng.uniform(-np.pi, np.pi)) for m, p in zip(chosen, PLACES, strict=True)]
    angles = rng.uniform(*ANGLES, 2) * rng.choice([-1, 1], 2)
    end = [*map(rolled, chosen[:2], start[:2], angles), *start[2:]]
    table = Table(chosen, seed)
    table.watch(start, REST)
    go(table, start, end)
    ids = table.ids()
    rolling = list(zip(names[:2], np.degrees(angles).tolist(), ids[:2], strict=True))
    return rolling, [name for name, found in zip(names[2:], ids[2:], strict=True) if found]


def is_one(ids: dict[int, float]) -> bool:
    """Whether a thing has one id, on most of it."""
    return len(ids) == 1 and max(ids.values()) > MOST


def main() -> int:
    """Draw scenes until enough has rolled; 0 if nine in ten of it are one, and nothing that stood is found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=40, help="how many roll (40)")
    parser.add_argument("--seed", type=int, default=0, help="of the first scene; the others follow (0)")
    chosen = parser.parse_args()
    one, false = [], 0
    for seed in range(chosen.seed, chosen.seed + chosen.cases // 2):
        rolling, still = outcome(seed)
        for name, angle, ids in rolling:
            one.append(is_one(ids))
            shares = ", ".join(f"{a}: {share:.2f}" for a, share in ids.items())
            print(f"seed {seed}: {name} by {angle:.0f} degrees: {'one' if one[-1] else f'NOT one ({shares})'}")
        false += len(still)
        for name in still:
            print(f"seed {seed}: {name} stood still, and was FOUND", flush=True)
    print(f"{sum(one)} of {len(one)} are one; {false} of {len(one)} that stood still were found")
    return 0 if sum(one) >= 0.9 * len(one) and not false else 1


if __name__ == "__main__":
    raise SystemExit(main())
