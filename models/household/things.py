"""The household things: shape, print, weight and gloss of each. Lengths in mm."""
# ruff: noqa: E501  (a table: a thing a line)

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.household import printing as p
from riseg_drake.models.household.bodies import Body, Paint, carton, slab, turned
from riseg_drake.models.objects.outlines import Field, disc, minus, polygon, stroke, union
from riseg_drake.models.objects.patterns import Pattern, cells, grained, plain, rings, spots, sprinkles, stripes
from riseg_drake.models.objects.solids import Profile

MATT, SATIN, GLOSSY = 0.9, 0.5, 0.22


@dataclass(frozen=True)
class Thing:
    """One recipe."""

    name: str
    make: Callable[[np.random.Generator], Body]
    mass: float
    """kg"""
    roughness: float = MATT
    metallic: float = 0.0
    friction: float = 0.5
    lying: bool = False
    """Modelled lying on its side: turned by a quarter about y."""


def _carton(
    name: str, size: tuple[float, float, float], top: p.Art, side: p.Art, mass: float, roughness: float = 0.7
) -> Thing:
    return Thing(name, lambda rng: carton(*size, top, side, rng), mass, roughness)


def _can(radius: float, height: float) -> list[tuple[float, float]]:
    """A tin: rims below and above, the lid a little sunk."""
    return [
        (0, 0.0), (radius - 1.5, 0.0), (radius, 1.5), (radius, 3.0), (radius - 1, 4.5),
        (radius - 1, height - 4.5), (radius, height - 3), (radius, height - 1), (radius - 1.5, height),
        (radius - 3, height - 2.0), (0, height - 2.0),
    ]  # fmt: skip


def _bottle(
    radius: float, height: float, neck: float, shoulder: float, cap: float
) -> list[tuple[float, float]]:
    """A bottle: straight up to the shoulder, narrowing to a neck, a cap on top."""
    rise = height - cap - shoulder
    curve = [
        (neck + (radius - neck) * float(np.cos(t)), shoulder + 0.8 * rise * float(np.sin(t)))
        for t in np.linspace(0, np.pi / 2, 6)
    ]
    return [
        (0, 0.0), (radius - 4, 0.0), (radius - 1, 1.2), (radius, 4.0), *curve, (neck, height - cap),
        (neck + 2, height - cap), (neck + 2, height - 1), (neck + 1, height), (0, height),
    ]  # fmt: skip


def _cup(radius: float, foot: float, height: float, wall: float) -> list[tuple[float, float]]:
    """A mug or a beaker: foot, wall, rim, and the inside down again."""
    return [
        (0, 0.0), (foot - 2, 0.0), (foot, 2.0), (radius, 0.35 * height), (radius, height - 1.5),
        (radius - 0.4 * wall, height), (radius - wall, height - 1.0), (radius - wall, 0.35 * height),
        (foot - wall - 1, wall + 3.0), (foot - wall - 6, wall + 1.0), (0, wall + 1.0),
    ]  # fmt: skip


def _bowl(radius: float, foot: float, height: float, wall: float) -> list[tuple[float, float]]:
    """A bowl: a foot, a wall that opens upwards, and the inside down again."""
    t = np.linspace(0.0, 1.0, 6)[1:]
    out = [
        (foot + (radius - foot) * float(np.sin(a * np.pi / 2)), 3.0 + (height - 4.0) * float(a**1.5)) for a in t
    ]
    inside = [(r - wall, max(z, wall + 3.0)) for r, z in reversed(out)]
    return [
        (0, 0.0), (foot - 2, 0.0), (foot, 3.0), *out, (radius - 0.5 * wall, height),
        *inside, (foot - wall - 4.0, wall + 2.0), (0, wall + 2.0),
    ]  # fmt: skip


def _turned(
    name: str,
    profile: list[tuple[float, float]],
    paint: Paint,
    mass: float,
    roughness: float = SATIN,
    *,
    lying: bool = False,
    metallic: float = 0.0,
    oval: float = 1.0,
    hollow: bool = False,
    handle: tuple[float, float, float, p.Color] | None = None,
) -> Thing:
    return Thing(
        name,
        lambda rng: turned(profile, paint, rng, oval, handle, hollow),
        mass,
        roughness,
        metallic,
        lying=lying,
    )


def _slab(
    name: str,
    drawing: Field,
    profile: Profile,
    pattern: Pattern,
    mass: float,
    roughness: float = MATT,
    metallic: float = 0.0,
) -> Thing:
    return Thing(name, lambda rng: slab(drawing, profile, pattern, rng), mass, roughness, metallic)


def _oblong(length: float, width: float, corner: float) -> Field:
    a, b = 0.5 * length - corner, 0.5 * width - corner
    return polygon([(-a, -b), (a, -b), (a, b), (-a, b)], corner)


def _flat(height: float, run: float = 1.5) -> Profile:
    """Of a slab with slightly rounded edges."""
    return Profile(height, 0.72 * height, 0.16 * height, run, 0.8)


def _colored(color: p.Color) -> Pattern:
    return lambda points, rng: np.broadcast_to(np.array(color), (*points.shape[:-1], 3)).copy()


def _sheet(art: p.Art, length: float, width: float) -> Pattern:
    """A printed sheet laid over a slab, its middle on the origin."""

    def pattern(points: NDArray, rng: np.random.Generator) -> NDArray:
        sheet = art(length, width, rng)
        u = ((points[..., 0] + 0.5 * length) / length * sheet.shape[1]).astype(int)
        v = ((0.5 * width - points[..., 1]) / width * sheet.shape[0]).astype(int)
        return sheet[np.clip(v, 0, sheet.shape[0] - 1), np.clip(u, 0, sheet.shape[1] - 1)]

    return pattern


def _buttons(points: NDArray, rng: np.random.Generator) -> NDArray:
    """The top of a remote control: black, with rows of keys."""
    image = _colored(p.BLACK)(points, rng)
    key = np.abs(np.mod(points + 5.5, 11.0) - 5.5)
    on = (np.hypot(key[..., 0], key[..., 1]) < 3.2) & (np.abs(points[..., 1]) < 16) & (points[..., 0] > -35)
    image[on & (points[..., 0] < 52)] = (0.28, 0.28, 0.30)
    image[np.hypot(points[..., 0] - 60, points[..., 1]) < 3.5] = p.RED
    return image


_LEAVES = cells(5.0, 0.8, ["green", "teal", "green"], "cream")
_FRUIT = spots(plain("cream"), 9.0, 4.0, ["red", "orange", "yellow"])
_BISCUITS = sprinkles(plain("brown"), 5.0, 5.0, 1.8, ["cream", "yellow", "orange"])
_GRAIN = grained(stripes(3.0, ["cream", "yellow"], 40.0, 3.0), 0.2)
_WAVES = stripes(4.0, ["teal", "cream"], 80.0, 3.0)

THINGS = [
    # Printed cartons; the first seven are of one height, so that they can lie flush.
    _carton("carton_tea", (100, 70, 45), p.printed(p.GREEN, p.CREAM, (0.07, 0.26, 0.13), "GREEN TEA", _LEAVES), p.back(p.GREEN, p.CREAM), 0.11),
    _carton("carton_oats", (115, 80, 45), p.printed(p.CREAM, p.BROWN, p.ORANGE, "OATS", _GRAIN), p.back(p.CREAM, p.BROWN), 0.18),
    _carton("carton_soap", (85, 55, 45), p.printed(p.WHITE, p.WHITE, p.BLUE, "SOAP"), p.back(p.WHITE, p.BLUE), 0.12),
    _carton("carton_rice", (95, 60, 45), p.printed(p.RED, p.CREAM, (0.45, 0.05, 0.07), "RICE", _GRAIN), p.back(p.RED, p.CREAM), 0.20),
    _carton("carton_biscuits", (110, 60, 45), p.printed(p.BLUE, p.YELLOW, (0.05, 0.12, 0.35), "BISCUITS", _BISCUITS), p.back(p.BLUE, p.CREAM), 0.15),
    _carton("carton_muesli", (90, 75, 45), p.printed(p.ORANGE, p.WHITE, p.RED, "MUESLI", _FRUIT), p.back(p.ORANGE, p.WHITE), 0.16),
    _carton("carton_filters", (70, 60, 45), p.printed(p.CARDBOARD, p.BROWN, (0.55, 0.40, 0.25), "FILTERS"), p.back(p.CARDBOARD, p.BROWN), 0.07),
    _carton("carton_pasta", (150, 68, 34), p.printed(p.BLUE, p.WHITE, p.RED, "PASTA", _GRAIN), p.back(p.BLUE, p.WHITE), 0.22),
    _carton("carton_pills", (88, 46, 26), p.printed(p.WHITE, p.BLUE, (0.75, 0.85, 0.95), "DOLEX", _WAVES), p.back(p.WHITE, p.BLUE), 0.04),
    _carton("carton_sugar", (75, 60, 58), p.printed(p.WHITE, p.RED, p.PINK, "SUGAR", None), p.back(p.WHITE, p.RED), 0.22),
    _carton("carton_brown", (105, 75, 52), p.uni(p.CARDBOARD, 0.10), p.uni(p.CARDBOARD, 0.10), 0.16, MATT),
    # Plain things.
    _carton("box_white", (90, 62, 46), p.uni(p.WHITE), p.uni(p.WHITE), 0.13, MATT),
    _carton("box_white_flat", (110, 70, 22), p.uni(p.WHITE), p.uni(p.WHITE), 0.10, MATT),
    _carton("box_black", (86, 64, 42), p.uni(p.BLACK), p.uni(p.BLACK), 0.14, SATIN),
    _carton("box_red", (72, 56, 40), p.uni(p.RED), p.uni(p.RED), 0.11, SATIN),
    _slab("soap_white", _oblong(84, 54, 18), Profile(28, 16, 6, 14, 6), _colored(p.WHITE), 0.11, SATIN),
    _slab("sponge_yellow", _oblong(105, 68, 6), Profile(32, 26, 4, 5, 3), grained(spots(plain("yellow"), 4.5, 0.9, ["orange"]), 0.12), 0.05),
    _slab("case_black", _oblong(120, 62, 20), Profile(38, 20, 8, 16, 8), _colored(p.BLACK), 0.12, SATIN),
    # Cans.
    _turned("can_beans", _can(36, 70), Paint(p.STEEL, p.printed(p.TEAL, p.CREAM, p.RED, "BEANS BEANS", _FRUIT), 5, 65, rings=5.0), 0.36, 0.45),
    _turned("can_tuna", _can(42, 36), Paint(p.STEEL, p.printed(p.BLUE, p.WHITE, p.RED, "TUNA TUNA TUNA"), 5, 31, rings=6.0), 0.20, 0.45),
    _turned("can_tomatoes", _can(33, 60), Paint(p.STEEL, p.printed(p.RED, p.CREAM, p.GREEN, "TOMATOES", _FRUIT), 5, 55, rings=5.0), 0.30, 0.45),
    _turned("can_steel", _can(34, 66), Paint(p.STEEL, rings=5.0), 0.24, 0.32, metallic=0.35),
    _turned("can_black", _can(30, 58), Paint(p.BLACK), 0.20, SATIN),
    _turned("can_soda_lying", _can(30, 112), Paint(p.STEEL, p.printed(p.ORANGE, p.WHITE, p.BLUE, "ORANGE SODA", _FRUIT), 4, 108, rings=6.0), 0.30, GLOSSY, lying=True),
    # Bottles, standing and lying.
    _turned("bottle_vitamins", _bottle(31, 84, 24, 58, 18), Paint(p.BROWN, p.printed(p.CREAM, p.GREEN, p.YELLOW, "VITAMIN C"), 8, 52, p.WHITE, 66), 0.16, 0.3),
    _turned("bottle_shampoo", _bottle(36, 96, 14, 74, 14), Paint(p.TEAL, p.printed(p.WHITE, p.TEAL, p.PINK, "SHAMPOO"), 14, 66, p.WHITE, 82), 0.24, 0.3, oval=0.68),
    _turned("bottle_white", _bottle(28, 86, 13, 62, 14), Paint(p.WHITE, cap=(0.86, 0.86, 0.86), cap_from=72), 0.15, SATIN),
    _turned("bottle_water_lying", _bottle(30, 160, 12, 118, 14), Paint((0.55, 0.70, 0.80), p.printed(p.BLUE, p.WHITE, p.TEAL, "WATER", _WAVES), 40, 95, p.BLUE, 146), 0.28, GLOSSY, lying=True),
    _turned("bottle_sauce_lying", _bottle(24, 150, 10, 96, 16), Paint((0.30, 0.08, 0.05), p.printed(p.YELLOW, p.RED, p.GREEN, "HOT SAUCE"), 20, 80, p.GREEN, 134), 0.24, GLOSSY, lying=True),
    # Hollow things.
    _turned("mug_white", _cup(40, 30, 84, 4), Paint(p.WHITE, inside=p.WHITE), 0.30, 0.3, hollow=True, handle=(28, 18, 68, p.WHITE)),
    _turned("mug_striped", _cup(39, 31, 80, 4), Paint(p.CREAM, p.patterned(stripes(6.0, ["teal", "cream", "red"], 90.0)), 12, 70, inside=p.CREAM), 0.29, 0.3, hollow=True, handle=(27, 16, 64, p.TEAL)),
    _turned("mug_black", _cup(38, 30, 78, 4), Paint(p.BLACK, inside=p.BLACK), 0.28, GLOSSY, hollow=True, handle=(26, 16, 62, p.BLACK)),
    _turned("cup_red", _cup(36, 25, 72, 3), Paint(p.RED, inside=p.WHITE), 0.10, SATIN, hollow=True),
    _turned("bowl_white", _bowl(66, 32, 46, 5), Paint(p.WHITE, inside=p.WHITE), 0.34, 0.3, hollow=True),
    _turned("bowl_blue", _bowl(58, 30, 44, 5), Paint(p.BLUE, inside=p.CREAM), 0.28, 0.3, hollow=True),
    _turned("bowl_wood", _bowl(62, 34, 40, 6), Paint(p.BROWN, p.wood, 3, 39, inside=(0.45, 0.28, 0.15)), 0.20, MATT, hollow=True),
    # Low things, 5 to 9 mm.
    _slab("phone", _oblong(142, 70, 9), _flat(8.0), _sheet(lambda w, h, rng: _screen(w, h), 142, 70), 0.17, GLOSSY),
    _slab("chocolate", _oblong(130, 64, 2), _flat(9.0), _sheet(p.printed(p.VIOLET, p.CREAM, p.BROWN, "CHOCOLATE", _BISCUITS), 130, 64), 0.10, 0.35),
    _slab("booklet", _oblong(125, 85, 1.5), _flat(7.0, 1.0), _sheet(p.printed(p.YELLOW, p.BLACK, p.RED, "TRAVEL", _LEAVES), 125, 85), 0.12, SATIN),
    _slab("coaster_cork", disc(0, 0, 48), _flat(6.0), grained(spots(plain("cream"), 4.0, 1.1, ["brown", "orange"]), 0.2), 0.03),
    _slab("coaster_black", _oblong(94, 94, 8), _flat(6.0), _colored(p.BLACK), 0.08),
    _slab("ruler", _oblong(160, 32, 1.5), _flat(5.0, 1.0), _sheet(lambda w, h, rng: _scale(w, h, rng), 160, 32), 0.04),
    _slab("spanner", minus(union(stroke((-48, 0, 8), (48, 0, 8)), disc(-54, 0, 17), disc(54, 0, 15)), polygon([(-80, -6.5), (-52, -6.5), (-52, 6.5), (-80, 6.5)]), disc(56, 0, 7.5)), _flat(7.0), _colored(p.STEEL), 0.14, 0.35, 0.35),
    _slab("tile_white", _oblong(98, 98, 3), _flat(8.0), _colored(p.WHITE), 0.15, GLOSSY),
    # Glossy or dark, neither flat nor box.
    _slab("remote", _oblong(150, 44, 10), Profile(20, 13, 4, 6, 4), _buttons, 0.10, SATIN),
    _slab("plate_rings", disc(0, 0, 62), Profile(16, 9, 4, 10, 6), rings(9.0, ["cream", "teal", "cream", "cream"]), 0.24, GLOSSY),
]  # fmt: skip


def _screen(width: float, height: float) -> NDArray:
    """A telephone, face up and off: dark glass with a thin frame."""
    sheet = p.blank(width, height, (0.16, 0.17, 0.19))
    p.rectangle(sheet, 3, 3, width - 6, height - 6, (0.035, 0.037, 0.045))
    p.disc(sheet, width - 7, 0.5 * height, 1.8, (0.12, 0.12, 0.2))
    return sheet


def _scale(width: float, height: float, rng: np.random.Generator) -> NDArray:
    """A wooden ruler with its marks."""
    sheet = p.wood(width, height, rng, (0.78, 0.62, 0.38))
    for k in range(int(width - 10) // 2):
        length = 9.0 if k % 10 == 0 else 6.0 if k % 5 == 0 else 3.5
        p.rectangle(sheet, 5 + 2 * k, 0, 0.45, length, p.BLACK)
    return sheet
