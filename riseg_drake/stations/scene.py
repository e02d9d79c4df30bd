"""Scenes: objects close together on the table, drawn from a seed and at rest, or placed as one likes."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from riseg_drake.stations.layouts import Habit, Spot, centred, lay_out
from riseg_drake.stations.object_models import ObjectModel, SceneError, find_model, find_models
from riseg_drake.stations.placed_object import PlacedObject
from riseg_drake.stations.placement import check_apart
from riseg_drake.stations.settling import lay_pile, settle

__all__ = ["PlacedConfig", "SceneConfig", "check_scene", "draw_scene", "make_scene", "place_scene"]

DROP = 2e-4  # m; how far above its resting height an object starts
LAYOUTS_OF_A_CHOICE = 5
"""Whole layouts tried of the same objects, before others are drawn."""
FULL_CHOICES = 2
"""Of objects drawn, before fewer are."""
CHOICES, FEW_CHOICES = 30, 4
"""Of objects drawn before a scene is called impossible: for want of room, and where each takes seconds, as all
must come to rest."""


class _Layout(NamedTuple):
    """What a layout is where the scenario says nothing."""

    count_min: int
    count_max: int
    radius: float  # m
    habit: Habit


_LAYOUTS = {
    "spread": _Layout(4, 6, 0.15, Habit()),
    "packed": _Layout(4, 6, 0.17, Habit(right_angles=True, slides=True)),
    "crowd": _Layout(8, 12, 0.21, Habit(slides=True)),
    "pile": _Layout(5, 7, 0.20, Habit()),
}


@dataclass
class PlacedConfig:
    """One object in a place of one's own."""

    model: str = ""
    """An SDF or URDF file, or the folder of one; a path or a `package://` URL."""
    X_WB: list[float] = field(default_factory=lambda: [0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    """Pose of its body in W: x, y, z, m, and roll, pitch, yaw, rad. The table's top is z = 0."""


@dataclass
class SceneConfig:
    """What is drawn. The paper: 20 scenes of 4 to 6 objects in close proximity on a flat white table."""

    layout: str = field(default="spread", metadata={"choices": tuple(_LAYOUTS)})
    """`spread`: close together, some touching (as in the paper). `packed`: sides parallel, faces flush.
    `crowd`: many, each against others. `pile`: laid on one another."""
    objects: list[str] = field(default_factory=lambda: ["package://riseg_drake_models/objects"])
    """Folders, or `package://` URLs of some, of SDF or URDF models of one body each."""
    names: list[str] = field(default_factory=list)
    """Draw from these models only; empty: from all in the folders."""
    count_min: int | None = None
    """Fewest objects in a scene; if left out 4 (paper), in a crowd 8, in a pile 5."""
    count_max: int | None = None
    """Most objects in a scene; if left out 6 (paper), in a crowd 12, in a pile 7."""
    centre_W: list[float] = field(
        default_factory=lambda: [0.5, 0.0], metadata={"sizes": (2,), "least": -1.5, "most": 1.5}
    )
    """Middle of the work area on the table, x and y in W, m."""
    radius: float | None = None
    """No part of an object is further from the middle than this, m; if left out 0.15, packed 0.17, in a pile
    0.20, in a crowd 0.21."""
    touch_probability: float = 0.6
    """How likely, in `spread`, an object is laid against another; else it gets a gap."""
    touch_gap: float = 0.001
    """Largest gap between objects that count as touching, m."""
    gap_min: float = 0.003
    """Smallest gap otherwise, m."""
    gap_max: float = 0.012
    """Largest gap otherwise, m."""
    placed: list[PlacedConfig] | None = None
    """Objects in places of one's own, at least one; nothing is drawn then."""

    def check(self) -> None:
        """Raise ValueError for what can never be drawn; whether it is to be drawn at all, making it tells."""
        if self.placed is None:
            check_scene(self)


_DRAWN = tuple(each.name for each in fields(SceneConfig) if each.name not in ("centre_W", "placed"))
"""Keys that say what is drawn."""


def make_scene(config: SceneConfig, rng: np.random.Generator) -> list[PlacedObject]:
    """The objects that are placed, or a drawn scene. Raises SceneError."""
    check_scene(config)
    return draw_scene(config, rng) if config.placed is None else place_scene(config.placed)


def check_scene(config: SceneConfig) -> None:
    """Raise SceneError for what can never be drawn, and where a scene is said to be placed and nothing is, or
    something to be drawn, too."""
    if config.placed is None:
        _kind(config)
        return
    if not config.placed:
        raise SceneError("placed: an empty list; expected one object or more, or no `placed`, to draw a scene")
    own = SceneConfig()
    drawn = [key for key in _DRAWN if getattr(config, key) != getattr(own, key)]
    if drawn:
        raise SceneError(
            f"{', '.join(drawn)}: of no account where objects are `placed`; leave out the one or the other"
        )


def place_scene(placed: Sequence[PlacedConfig]) -> list[PlacedObject]:
    """Objects exactly where they are said to be. Raises SceneError, also for one in the table or another."""
    objects = []
    for k, item in enumerate(placed):
        if len(item.X_WB) != 6:
            raise SceneError(
                f"placed[{k}].X_WB: {len(item.X_WB)} numbers; expected x, y, z in m and roll, pitch, yaw in rad"
            )
        if np.abs(item.X_WB[3:]).max() > 2 * np.pi:
            raise SceneError(f"placed[{k}].X_WB: {item.X_WB}; roll, pitch, yaw are radians, at most 2 pi")
        X_WB = RigidTransform(RollPitchYaw(item.X_WB[3:]), item.X_WB[:3])
        try:
            model = find_model(item.model)
        except SceneError as error:
            said = str(error).removeprefix("model: ").removeprefix("objects: ")
            raise SceneError(f"placed[{k}].model: {said}") from None
        objects.append(PlacedObject(model, X_WB))
    check_apart(objects)
    return objects


def draw_scene(config: SceneConfig, rng: np.random.Generator) -> list[PlacedObject]:
    """Draw a scene and let it settle; the same for the same generator state. Raises SceneError."""
    kind = _kind(config)
    models = find_models(config.objects, config.names)
    if len(models) < kind.count_min:
        raise SceneError(
            f"count_min: {kind.count_min} different objects wanted, but {_named(config.objects)} offers "
            f"{len(models)}; add models or ask for fewer"
        )
    round_ones = [model.name for model in models if not model.has_flat_sides]
    if config.layout == "packed" and len(models) - len(round_ones) < min(2, len(models)):
        raise SceneError(
            f"layout: packed lays flat sides together, but {_named(round_ones)} are round; "
            "add things with flat sides, or use layout: spread"
        )
    count = int(rng.integers(kind.count_min, min(kind.count_max, len(models)) + 1))
    restless = ""
    for choice in itertools.count():
        if choice >= FULL_CHOICES:  # so many have no room
            count = max(kind.count_min, count - 1)
        chosen = [models[i] for i in rng.permutation(len(models))[:count]]
        if config.layout != "spread":  # the large ones first: the others find room about them, and on them
            chosen.sort(key=lambda model: -float(np.prod(np.ptp(model.footprint.corners(), axis=0))))
        for _ in range(LAYOUTS_OF_A_CHOICE):
            laid = _laid(chosen, kind, config, rng)
            if laid is None:
                continue
            if config.layout == "pile":
                return laid
            at_rest = settle(laid, config.centre_W)
            restless = _restless(laid, at_rest)
            if not restless:
                return at_rest
        takes_long = restless or config.layout == "pile"
        if choice + 1 >= (FEW_CHOICES if takes_long else CHOICES) and count == kind.count_min:
            break
    if restless:
        raise SceneError(f"{restless}; model it with z up, standing on a face or on three points or more")
    raise _no_room(chosen, kind, config.layout)


def _laid(
    chosen: Sequence[ObjectModel], kind: _Layout, config: SceneConfig, rng: np.random.Generator
) -> list[PlacedObject] | None:
    """The objects in places of their own, a pile at rest, all others before they have settled; None where there
    is no room."""
    if config.layout == "pile":
        heap = lay_pile(chosen, config.centre_W, rng)
        return heap if heap is not None and _reach(heap, config.centre_W) < kind.radius else None
    shapes = [model.footprint for model in chosen]
    spots = lay_out(shapes, (_gap(config, rng) for _ in chosen), kind.habit, rng)
    spots = centred(spots, shapes, config.centre_W, kind.radius) if spots else None
    if spots is None:
        return None
    return [_stand(model, spot) for model, spot in zip(chosen, spots, strict=True)]


def _reach(placed: Sequence[PlacedObject], centre_W: Sequence[float]) -> float:
    """How far from the middle anything of the objects is, m."""
    corners = np.vstack([item.X_WB.multiply(item.model.corners.T).T for item in placed])[:, :2]
    return float(np.linalg.norm(corners - centre_W, axis=1).max())


def _no_room(chosen: Sequence[ObjectModel], kind: _Layout, layout: str) -> SceneError:
    what = "come to rest as a pile" if layout == "pile" else "fit"
    return SceneError(
        f"{len(chosen)} objects ({', '.join(model.name for model in chosen)}) do not {what} within "
        f"{kind.radius:g} m of the middle; ask for fewer, smaller ones, or enlarge radius"
    )


def _kind(config: SceneConfig) -> _Layout:
    """The layout with what the scenario says in place of its own. Raises SceneError for what can never be."""
    if config.layout not in _LAYOUTS:
        raise SceneError(f"layout: {config.layout!r}; expected one of {', '.join(_LAYOUTS)}")
    own = _LAYOUTS[config.layout]
    # One bound alone moves the other along, where it must.
    low = config.count_min if config.count_min is not None else min(own.count_min, config.count_max or 99)
    high = config.count_max if config.count_max is not None else max(own.count_max, low)
    radius = own.radius if config.radius is None else config.radius
    if not 1 <= low <= high:
        raise SceneError(f"count_min, count_max: {low}, {high}; expected 1 <= min <= max")
    if config.layout == "pile" and low < 2:
        raise SceneError(f"count_min, count_max: {low}, {high}; a pile is 2 things or more, one on another")
    if len(config.centre_W) != 2:
        raise SceneError(f"centre_W: {config.centre_W}; expected x and y in metres")
    if radius <= 0:
        raise SceneError(f"radius: {radius:g}; expected metres, more than 0")
    if not 0 <= config.touch_probability <= 1:
        raise SceneError(f"touch_probability: {config.touch_probability:g}; expected 0 to 1")
    if config.touch_gap < 0 or not 0 <= config.gap_min <= config.gap_max:
        raise SceneError("touch_gap, gap_min, gap_max: expected 0 <= touch_gap, 0 <= gap_min <= gap_max")
    return _Layout(low, high, radius, own.habit)


def _gap(config: SceneConfig, rng: np.random.Generator) -> float:
    """How far an object stays away from what it meets, m."""
    if config.layout != "spread":
        return float(rng.uniform(0.0, 0.5 * config.touch_gap))
    touching = rng.uniform() < config.touch_probability
    low, high = (0.0, config.touch_gap) if touching else (config.gap_min, config.gap_max)
    return float(rng.uniform(low, high))


def _stand(model: ObjectModel, spot: Spot) -> PlacedObject:
    """A model turned about the vertical to its spot, its lowest point a little above the table."""
    yaw, p_xy = spot
    R_WB = RotationMatrix.MakeZRotation(yaw).multiply(model.X_WB.rotation())
    return PlacedObject(model, RigidTransform(R_WB, [*p_xy, DROP - model.footprint.bottom]))


def _restless(placed: Sequence[PlacedObject], at_rest: Sequence[PlacedObject]) -> str:
    """What is wrong with a settled scene: an object that fell over, rolled away or sank; or nothing."""
    for before, after in zip(placed, at_rest, strict=True):
        shift = np.linalg.norm(after.X_WB.translation() - before.X_WB.translation())
        angle = (before.X_WB.rotation().inverse().multiply(after.X_WB.rotation())).ToAngleAxis().angle()
        if shift > 0.005 or angle > np.radians(3.0):
            return (
                f"{before.name} does not stay where it is put: it moved {1e3 * shift:.0f} mm and turned "
                f"{np.degrees(angle):.0f} degrees while settling"
            )
    return ""


def _named(folders: str | Sequence[str]) -> str:
    return folders if isinstance(folders, str) else ", ".join(folders)
