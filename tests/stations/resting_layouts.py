"""How drawn scenes lie, seed by seed, against what is promised of them.

python -m tests.stations.resting_layouts packed
python -m tests.stations.resting_layouts pile --seed 100 --seeds 20
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from unittest import mock

import numpy as np
from scipy.cluster.hierarchy import linkage

from riseg_drake.app.scenario import load_scenario
from riseg_drake.stations import scene
from riseg_drake.stations.footprint import Footprint, separation
from riseg_drake.stations.placed_object import PlacedObject
from riseg_drake.stations.scene import SceneConfig, draw_scene
from riseg_drake.stations.settling import TABLE, SettlingTable, settle

SUITE = Path(__file__).parents[2] / "diagrams" / "suites" / "clutter"
KINDS = {"packed": SUITE / "2_packed.yaml", "pile": SUITE / "4_pile.yaml"}
GAP, MOVED = 1e-3, 1e-3
"""m; what is packed hangs together by gaps so narrow, and moves no further while it settles."""
AGAINST = 1 / 3
"""Share of a pile's things that lie on or against another, at least."""
CREEP = 5e-4
"""m; what is at rest moves no further in another second."""


@dataclass(frozen=True)
class Packed:
    """How the things of one packed scene lie."""

    things: int
    gap: float
    """m; the widest of those by which all things hang together, seen from above."""
    moved: float
    """m; the most that one moved while it settled."""
    crept: float
    """m; the most that one moves in another second; infinite where one does not stay at rest."""

    @property
    def holds(self) -> bool:
        """Whether they lie as promised."""
        return 0 < self.gap <= GAP and self.moved <= MOVED and self.crept <= CREEP

    def __str__(self) -> str:
        return (
            f"{self.things} things, gap {1e3 * self.gap:.2f} mm, moved {1e3 * self.moved:.2f} mm, "
            f"then {1e3 * self.crept:.3f} mm a second"
        )


@dataclass(frozen=True)
class Pile:
    """How the things of one pile lie."""

    things: int
    against: int
    """Things that touch another."""
    carried: int
    """Of these, things that touch no table."""
    crept: float
    """m; the most that one moves in another second; infinite where one does not stay at rest."""
    same_again: bool
    """Whether the same seed gives the same, to the last bit."""

    @property
    def holds(self) -> bool:
        """Whether they lie as promised."""
        return self.against >= AGAINST * self.things and self.crept <= CREEP and self.same_again

    def __str__(self) -> str:
        return (
            f"{self.things} things, {self.against} against others, {self.carried} carried, "
            f"then {1e3 * self.crept:.3f} mm a second, {'' if self.same_again else 'not '}the same again"
        )


def packed(config: SceneConfig, seed: int) -> Packed:
    """Draw a packed scene and measure it."""
    with mock.patch.object(scene, "settle", wraps=settle) as settling:
        drawn = draw_scene(config, np.random.default_rng(seed))
    put = settling.call_args.args[0]
    crept, _ = _another_second(drawn, config)
    return Packed(len(drawn), widest_gap(drawn), furthest(put, drawn), crept)


def pile(config: SceneConfig, seed: int) -> Pile:
    """Draw a pile and measure it, and draw it once more."""
    drawn, again = (draw_scene(config, np.random.default_rng(seed)) for _ in range(2))
    crept, touching = _another_second(drawn, config)
    against = set().union(*(pair for pair in touching if TABLE not in pair))
    on_table = set().union(*(pair for pair in touching if TABLE in pair))
    same = [item.name for item in drawn] == [item.name for item in again] and all(
        np.array_equal(a.X_WB.GetAsMatrix4(), b.X_WB.GetAsMatrix4()) for a, b in zip(drawn, again, strict=True)
    )
    return Pile(len(drawn), len(against), len(against - on_table), crept, same)


def lying(item: PlacedObject) -> Footprint:
    """A standing object's footprint where it came to rest."""
    R = item.X_WB.rotation().multiply(item.model.X_WB.rotation().inverse()).matrix()
    return item.model.footprint.moved(np.arctan2(R[1, 0], R[0, 0]), item.X_WB.translation()[:2])


def widest_gap(placed: Sequence[PlacedObject]) -> float:
    """The widest of the gaps by which all objects hang together, each by the narrowest there is, m."""
    gaps = [separation(a, b) for a, b in combinations([lying(item) for item in placed], 2)]
    return float(linkage(gaps, "single")[-1, 2])


def furthest(before: Sequence[PlacedObject], after: Sequence[PlacedObject]) -> float:
    """The most that an object's origin has moved, m."""
    return max(
        float(np.linalg.norm(a.X_WB.translation() - b.X_WB.translation()))
        for a, b in zip(before, after, strict=True)
    )


def _another_second(drawn: Sequence[PlacedObject], config: SceneConfig) -> tuple[float, set[frozenset[int]]]:
    """The most that an object moves in a second, m, in a plant of its own; and what touches then."""
    table = SettlingTable(drawn, config.centre_W)
    stays = table.stay(1.0)
    crept = furthest(drawn, table.objects()) if stays else float("inf")
    return crept, table.touching()


def main() -> int:
    """Measure a kind of scenes; 0 if all are as promised."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--seed", type=int, default=0, help="the first one (0)")
    parser.add_argument("--seeds", type=int, default=20, help="how many, from there on (20)")
    chosen = parser.parse_args()
    config = load_scenario(KINDS[chosen.kind]).simulated.scene
    measure = packed if chosen.kind == "packed" else pile
    good = 0
    for seed in range(chosen.seed, chosen.seed + chosen.seeds):
        figures = measure(config, seed)
        good += figures.holds
        print(f"seed {seed}: {figures}{'' if figures.holds else '  <- not as promised'}", flush=True)
    print(f"{good} of {chosen.seeds} as promised")
    return 0 if good == chosen.seeds else 1


if __name__ == "__main__":
    raise SystemExit(main())
