"""What is printed on household things: words, fine print, bars, pictures, on sheets measured in mm.

A sheet is an image of floats RGB [h, w, 3] in 0..1 with RESOLUTION mm a texel; x runs right, y down.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.objects.patterns import Pattern, grained, plain
from scipy.ndimage import gaussian_filter, zoom

RESOLUTION = 0.45  # mm a texel; a pixel sees 0.8 mm from 0.5 m
Color = tuple[float, float, float]
Art = Callable[[float, float, np.random.Generator], NDArray]
"""Paints a sheet of a width and a height, mm."""

WHITE, BLACK = (0.93, 0.93, 0.92), (0.06, 0.06, 0.065)
CARDBOARD, STEEL = (0.62, 0.47, 0.31), (0.72, 0.73, 0.75)
RED, BLUE, GREEN = (0.72, 0.10, 0.12), (0.10, 0.25, 0.58), (0.13, 0.45, 0.22)
YELLOW, ORANGE, TEAL = (0.94, 0.76, 0.14), (0.88, 0.42, 0.10), (0.06, 0.45, 0.50)
CREAM, PINK, VIOLET, BROWN = (0.94, 0.89, 0.77), (0.87, 0.52, 0.60), (0.33, 0.17, 0.42), (0.36, 0.21, 0.12)

_GLYPHS = {  # seven rows of five dots, a row in two hexadecimal digits
    "A": "0E11111F111111", "B": "1E11111E11111E", "C": "0E11101010110E", "D": "1C12111111121C",
    "E": "1F10101E10101F", "F": "1F10101E101010", "G": "0E11101711110F", "H": "1111111F111111",
    "I": "0E04040404040E", "J": "0702020202120C", "K": "11121418141211", "L": "1010101010101F",
    "M": "111B1515111111", "N": "11191513111111", "O": "0E11111111110E", "P": "1E11111E101010",
    "Q": "0E11111115120D", "R": "1E11111E141211", "S": "0F10100E01011E", "T": "1F040404040404",
    "U": "1111111111110E", "V": "11111111110A04", "W": "11111115151B11", "X": "11110A040A1111",
    "Y": "11110A04040404", "Z": "1F01020408101F", " ": "00000000000000",
}  # fmt: skip


def blank(width: float, height: float, color: Color) -> NDArray:
    """A sheet of one colour."""
    shape = max(2, round(height / RESOLUTION)), max(2, round(width / RESOLUTION))
    return np.broadcast_to(np.array(color), (*shape, 3)).copy()


def rectangle(sheet: NDArray, x: float, y: float, width: float, height: float, color: Color) -> None:
    """Fill a rectangle whose upper left corner is at (x, y)."""
    u, v = (max(0, round(c / RESOLUTION)) for c in (x, y))
    u_end, v_end = (max(0, round(c / RESOLUTION)) for c in (x + width, y + height))
    sheet[v:v_end, u:u_end] = color


def disc(sheet: NDArray, x: float, y: float, radius: float, color: Color) -> None:
    """Fill a disc about (x, y)."""
    sheet[np.hypot(*np.moveaxis(_points(sheet) - (x, y), -1, 0)) < radius] = color


def picture(sheet: NDArray, x: float, y: float, width: float, height: float, pattern: Pattern, rng) -> None:  # type: ignore[no-untyped-def]
    """Print a pattern into a rectangle whose upper left corner is at (x, y)."""
    part = sheet[round(y / RESOLUTION) : round((y + height) / RESOLUTION)]
    part = part[:, round(x / RESOLUTION) : round((x + width) / RESOLUTION)]
    if part.size:
        part[:] = pattern(_points(part), rng)


def word(
    sheet: NDArray, x: float, y: float, height: float, text: str, color: Color, bold: float = 0.9
) -> float:
    """Print a word of capitals, `height` mm high, from (x, y) on; returns its width in mm."""
    dots = np.hstack(
        [np.pad([[int(b) for b in f"{int(row, 16):05b}"] for row in _rows(c)], ((0, 0), (0, 1))) for c in text]
    )
    scale = height / RESOLUTION / 7.0
    ink = zoom(dots.astype(float), scale, order=0, grid_mode=True, mode="nearest")
    ink = np.clip(gaussian_filter(ink, 0.22 * scale) * (1.0 + bold), 0.0, 1.0)[..., None]
    u, v = max(0, round(x / RESOLUTION)), max(0, round(y / RESOLUTION))
    part = sheet[v : v + len(ink), u : u + ink.shape[1]]
    ink = ink[: part.shape[0], : part.shape[1]]
    part[:] = part * (1.0 - ink) + np.array(color) * ink
    return float(ink.shape[1] * RESOLUTION)


def fine_print(
    sheet: NDArray, x: float, y: float, width: float, height: float, color: Color, rng: np.random.Generator
) -> None:
    """Lines too small to be read: dashes of words 1.3 mm high."""
    for line in np.arange(y, y + height - 1.3, 2.6):
        at = x
        while at < x + width - 2.0:
            length = rng.uniform(1.5, 6.0)
            rectangle(sheet, at, line, min(length, x + width - at), 1.3, color)
            at += length + 1.0


def bar_code(sheet: NDArray, x: float, y: float, width: float, height: float, rng: np.random.Generator) -> None:
    """Black bars on a white field."""
    rectangle(sheet, x, y, width, height, WHITE)
    at = x + 2.0
    while at < x + width - 2.5:
        thick = rng.choice([0.45, 0.9, 1.35])
        rectangle(sheet, at, y + 1.0, thick, height - 2.0, BLACK)
        at += thick + rng.choice([0.45, 0.9, 1.35])


def printed(color: Color, ink: Color, accent: Color, name: str, inlay: Pattern | None = None) -> Art:
    """The front of a packet: a band with the name, a picture or a disc, stripes, fine print."""

    def art(width: float, height: float, rng: np.random.Generator) -> NDArray:
        sheet = blank(width, height, color)
        long, short = max(width, height), min(width, height)
        turned = height > 1.4 * width
        canvas = np.rot90(sheet).copy() if turned else sheet
        letter = min(0.34 * short, 0.82 * long / (0.86 * len(name)))
        rectangle(canvas, 0.0, 0.10 * short, long, 1.35 * letter, accent)
        word(canvas, 0.06 * long, 0.10 * short + 0.17 * letter, letter, name, ink)
        below = 0.16 * short + 1.35 * letter
        room = 0.94 * short - below
        if inlay is not None and room > 6.0:
            picture(canvas, 0.55 * long, below, 0.40 * long, room, inlay, rng)
        elif room > 6.0:
            disc(canvas, 0.76 * long, below + 0.5 * room, 0.45 * room, accent)
        fine_print(canvas, 0.06 * long, below + 1.0, 0.42 * long, room - 1.0, ink, rng)
        return np.rot90(canvas, -1).copy() if turned else canvas

    return art


def back(color: Color, ink: Color) -> Art:
    """The other sides of a packet: fine print in columns and a bar code."""

    def art(width: float, height: float, rng: np.random.Generator) -> NDArray:
        sheet = blank(width, height, color)
        fine_print(sheet, 0.06 * width, 0.12 * height, 0.48 * width, 0.76 * height, ink, rng)
        bar_code(sheet, 0.62 * width, 0.2 * height, min(30.0, 0.32 * width), min(16.0, 0.6 * height), rng)
        return sheet

    return art


def uni(color: Color, grain: float = 0.0) -> Art:
    """One colour and no print; `grain` roughens it a little, as of cardboard or wood."""

    def art(width: float, height: float, rng: np.random.Generator) -> NDArray:
        sheet = blank(width, height, color)
        if grain:
            mottle = grained(plain("cream"), grain, 1.2)(_points(sheet), rng).mean(axis=-1, keepdims=True)
            sheet *= mottle / mottle.mean()
        return np.clip(sheet, 0.0, 1.0)

    return art


def patterned(pattern: Pattern) -> Art:
    """A pattern of the toys' on a whole sheet."""

    def art(width: float, height: float, rng: np.random.Generator) -> NDArray:
        return pattern(_points(blank(width, height, WHITE)), rng)

    return art


def wood(width: float, height: float, rng: np.random.Generator, color: Color = (0.60, 0.40, 0.22)) -> NDArray:
    """Grain along x: wavy dark lines, finer streaks, boards of their own tone are up to the caller."""
    sheet = blank(width, height, color)
    rows, columns = sheet.shape[:2]
    warp = gaussian_filter(rng.normal(size=(rows, columns)), (18 / RESOLUTION, 60 / RESOLUTION), mode="wrap")
    warp *= 6.0 / max(float(np.abs(warp).max()), 1e-9)
    y = np.arange(rows)[:, None] * RESOLUTION
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (y / 7.0 + warp))
    streaks = gaussian_filter(rng.normal(size=(rows, columns)), (0.8, 25.0), mode="wrap")
    streaks /= streaks.std()
    return np.clip(sheet * (0.82 + 0.22 * rings + 0.045 * streaks)[..., None], 0.0, 1.0)


def _points(sheet: NDArray) -> NDArray:
    """Where the texels of a sheet lie, mm [h, w, 2]."""
    rows, columns = sheet.shape[:2]
    return np.stack(np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5), axis=-1) * RESOLUTION


def _rows(letter: str) -> list[str]:
    digits = _GLYPHS[letter]
    return [digits[k : k + 2] for k in range(0, 14, 2)]
