"""The toys: for each a silhouette, a profile, a pattern, a density and a friction. Lengths in mm."""

from dataclasses import dataclass

import numpy as np
from riseg_drake.models.objects.outlines import (
    Field,
    arc,
    disc,
    ellipse,
    minus,
    polygon,
    stroke,
    union,
)
from riseg_drake.models.objects.patterns import (
    Pattern,
    cells,
    grained,
    plain,
    rings,
    scales,
    spots,
    sprinkles,
    stripes,
    wedges,
    zoned,
)
from riseg_drake.models.objects.solids import Profile


@dataclass(frozen=True)
class Toy:
    """One recipe. `density` in kg/m^3 (wood to solid rubber), `friction` against a like surface."""

    name: str
    drawing: Field
    profile: Profile
    pattern: Pattern
    density: float = 550.0
    friction: float = 0.7


def _star(points: int, outer: float, inner: float) -> list[tuple[float, float]]:
    angles = np.pi / 2 + np.arange(2 * points) * np.pi / points
    radii = np.where(np.arange(2 * points) % 2 == 0, outer, inner)
    return [(float(r * np.cos(t)), float(r * np.sin(t))) for r, t in zip(radii, angles, strict=True)]


TOYS = [
    Toy(
        "aubergine",
        stroke((-34, -2, 20), (-12, 0, 23), (14, 3, 17), (34, 7, 12)),
        Profile(38, 13, 6, 20, 8),
        grained(
            zoned([(disc(52, 12, 24), stripes(3.0, ["green", "teal"], 70, 1.0))], plain("violet")),
            0.10,
            6.0,
        ),
        600,
    ),
    Toy(
        "banana",
        arc(0, -34, 46, 25, 155, [6, 11, 14.5, 16, 16, 14.5, 11, 6]),
        Profile(30, 13, 5, 13, 5),
        grained(
            zoned(
                [(disc(-44, -14, 11), plain("brown")), (disc(44, -14, 11), plain("green"))],
                spots(spots(plain("yellow"), 9, 3.0, ["brown", "orange"]), 4.5, 1.0, ["brown"]),
            )
        ),
        800,
    ),
    Toy(
        "cheese",
        polygon([(-36, -24), (38, -6), (38, 8), (-36, 26)], 4),
        Profile(28, 24, 3, 3, 3),
        plain("yellow"),
        700,
    ),
    Toy(
        "cookie",
        disc(0, 0, 35),
        Profile(15, 9, 3, 10, 3),
        grained(spots(spots(plain("orange"), 9, 3.0, ["brown", "black"]), 5, 1.1, ["yellow", "cream"]), 0.15),
        850,
        0.75,
    ),
    Toy(
        "croissant",
        arc(0, -12, 33, -35, 215, [6, 11, 15, 17.5, 18.5, 17.5, 15, 11, 6]),
        Profile(32, 12, 5, 15, 6),
        grained(wedges(26, ["yellow", "orange", "cream", "brown"], "brown", [], []), 0.18),
        500,
        0.75,
    ),
    Toy(
        "doughnut",
        minus(disc(0, 0, 42), disc(0, 0, 14)),
        Profile(25, 11, 5, 13, 5),
        grained(
            zoned(
                [
                    (
                        disc(0, 0, 39),
                        sprinkles(plain("pink"), 5.5, 5, 1.8, ["cream", "teal", "yellow", "red"]),
                    )
                ],
                stripes(3.0, ["brown", "orange"], 30, 3.0),
            )
        ),
        700,
    ),
    Toy(
        "elephant",
        union(
            ellipse(-12, 8, 31, 23),
            disc(24, 16, 17),
            stroke((36, 14, 9), (47, 2, 7.5), (50, -14, 6), (45, -24, 5)),
            stroke((-30, -4, 10), (-31, -26, 9)),
            stroke((4, -4, 10), (6, -26, 9)),
        ),
        Profile(38, 14, 4, 11, 3),
        grained(cells(10, 1.3, ["teal", "pink", "yellow", "red", "cream"], "black"), 0.15),
        600,
    ),
    Toy(
        "fish",
        union(
            ellipse(8, 0, 36, 22),
            polygon([(-20, 0), (-44, 22), (-38, 0), (-44, -22)], 4),
            polygon([(0, 16), (14, 30), (24, 14)], 2),
        ),
        Profile(27, 12, 4, 12, 3),
        grained(
            zoned(
                [(disc(32, 6, 4.5), rings(1.8, ["black", "cream"], (32, 6)))],
                scales(8.0, ["teal", "orange", "yellow", "cream"], "black"),
            )
        ),
        800,
    ),
    Toy(
        "giraffe",
        union(
            ellipse(-10, -10, 25, 14, 12),
            stroke((8, -6, 11), (20, 22, 8), (26, 44, 7)),
            stroke((26, 46, 8.5), (42, 40, 6.5)),
            stroke((-26, -16, 7), (-28, -42, 5.5)),
            stroke((4, -12, 7), (6, -42, 5.5)),
        ),
        Profile(22, 11, 3, 6, 2.5),
        grained(cells(11, 2.0, ["brown", "orange", "brown"], "cream"), 0.15),
        800,
    ),
    Toy(
        "ladybird",
        union(
            ellipse(-4, 0, 32, 28),
            disc(27, 0, 14),
            *[
                stroke((x, 0, 4), (x + dx, side * 34, 4))
                for x, dx in ((-16, -8), (0, 2), (16, 8))
                for side in (-1, 1)
            ],
        ),
        Profile(40, 11, 4, 28, 3),
        grained(
            zoned(
                [(disc(40, 0, 21), spots(plain("black"), 6, 1.6, ["cream"]))],
                spots(spots(plain("red"), 14, 5, ["black"]), 5, 1.0, ["orange", "brown"]),
            )
        ),
        600,
    ),
    Toy(
        "leopard",
        union(
            ellipse(-4, 2, 31, 15),
            disc(30, 14, 15),
            stroke((22, 24, 5), (20, 31, 4)),
            stroke((38, 24, 5), (41, 31, 4)),
            stroke((-26, -2, 8), (-30, -22, 7)),
            stroke((14, -4, 8), (16, -22, 7)),
            stroke((-32, 6, 6), (-48, 16, 5), (-50, 30, 4.5)),
        ),
        Profile(26, 12, 3, 8, 3),
        grained(spots(plain("yellow"), 7.5, 3.6, ["orange", "brown"], ring="black"), 0.12),
        800,
    ),
    Toy(
        "orange",
        disc(0, 0, 34),
        Profile(46, 14, 9, 34, 13),
        grained(wedges(11, ["orange", "yellow", "orange"], "cream", [31, 34.5], ["cream", "orange"]), 0.25),
        700,
    ),
    Toy(
        "pizza",
        polygon([(-38, -26), (38, 0), (-38, 26)], 5),
        Profile(15, 11, 2.5, 4, 2.5),
        grained(
            zoned(
                [
                    (
                        polygon([(-99, -60), (-34, -60), (-34, 60), (-99, 60)]),
                        stripes(4, ["brown", "orange"], 60, 3),
                    )
                ],
                spots(spots(plain("yellow"), 17, 7.0, ["red"]), 6.5, 1.6, ["green", "cream", "brown"]),
            ),
            0.18,
        ),
        900,
        0.75,
    ),
    Toy(
        "snake",
        stroke(
            *[
                (float(x), float(24 * np.sin(x / 15.5)), float(10.0 - 4.0 * max(0.0, -x - 20) / 28))
                for x in np.linspace(-46, 40, 24)
            ],
            (46, 4, 12),
        ),
        Profile(20, 10, 4, 9, 3),
        grained(stripes(4.5, ["red", "black", "yellow", "black"], 15, 3.0), 0.12),
        900,
    ),
    Toy(
        "starfish",
        polygon(_star(5, 46, 19), 5),
        Profile(15, 9, 2.5, 7, 2.5),
        grained(spots(spots(plain("orange"), 8, 2.6, ["cream", "red"]), 4.5, 0.9, ["brown"]), 0.12),
        800,
    ),
    Toy(
        "watermelon",
        minus(disc(0, -20, 50), polygon([(-99, -99), (99, -99), (99, -20), (-99, -20)])),
        Profile(24, 20, 3, 4, 3),
        grained(
            zoned(
                [
                    (
                        minus(disc(0, -20, 99), disc(0, -20, 41)),
                        zoned(
                            [
                                (
                                    minus(disc(0, -20, 99), disc(0, -20, 45)),
                                    stripes(4, ["green", "teal"], 0, 2.5),
                                )
                            ],
                            plain("cream"),
                        ),
                    )
                ],
                spots(plain("red"), 8, 1.9, ["black", "black", "cream"]),
            ),
            0.18,
        ),
        850,
    ),
    Toy(
        "zebra",
        union(
            ellipse(-4, 2, 28, 14),
            stroke((16, 8, 10), (28, 28, 8.5)),
            stroke((29, 31, 9), (43, 24, 7)),
            stroke((-24, -2, 7.5), (-26, -30, 5.5)),
            stroke((14, -2, 7.5), (15, -30, 5.5)),
            stroke((-29, 8, 4), (-40, -4, 4)),
        ),
        Profile(24, 11, 3, 7, 3),
        grained(stripes(4.2, ["black", "cream"], 10, 3.5), 0.10),
        800,
    ),
]
