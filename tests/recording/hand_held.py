"""Films of a table that nobody touches, by a camera in a hand: what moves is the camera, and nothing is exact.

Wood, checks and other prints on the table and on boxes; the camera sways at some 10 cm/s and 20 degrees/s.
Poses are off as those of motion capture are (noise, drift, a hand-eye calibration that is not right), colour
is blurred by motion, taken later than depth, and exposed automatically; depth is a Kinect's.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import RecordedFrame
from tests.segmentation.drawn_room import VGA, structured_light
from tests.segmentation.drawn_scene import DrawnScene, planar

SIZES = [(0.16, 0.06, 0.22), (0.09, 0.09, 0.11), (0.20, 0.14, 0.06), (0.07, 0.12, 0.16), (0.24, 0.17, 0.03)]
PLACES = [(-0.25, 0.1, 0.4), (0.02, 0.12, 0.0), (0.24, 0.02, 1.0), (-0.05, -0.12, 0.2), (-0.3, -0.16, 0.1)]


class Print:
    """A picture on a surface: wood, checks or blotches. Looked up in the body's x and y, and along z aslant."""

    def __init__(self, kind: str, seed: int):
        rng = np.random.default_rng(seed)
        v, u = np.mgrid[:1024, :1024] * 0.001  # one pixel a millimetre, repeated
        if kind == "wood":
            rings = u * 60 + 1.5 * np.sin(v * 4 * np.pi / 1.024) + _blotches(rng, 40)
            gray = 150 + 25 * np.sin(2 * np.pi * np.round(rings * 1.024) / 8) + 8 * _blotches(rng, 3)
        elif kind == "checks":
            gray = 130 + 60 * np.sign(np.sin(u * 2 * np.pi / 0.064) * np.sin(v * 2 * np.pi / 0.064))
        elif kind == "blank":
            gray = np.full(u.shape, 190.0)
        else:
            gray = 130 + 30 * _blotches(rng, 12) + 20 * _blotches(rng, 4)
        self._picture = np.stack([gray * share for share in rng.uniform(0.75, 1.0, 3)], -1).astype(np.float32)

    def color(self, p_BQ: NDArray) -> NDArray:
        """[N, 3] gray values of points [N, 3]."""
        along = p_BQ[:, :2] + p_BQ[:, 2:] * np.array([0.6, 0.8])
        at = np.mod(along * 1000, 1024).astype(np.float32)
        side = int(np.ceil(len(at) / 1024))
        padded = np.zeros((side * 1024, 2), np.float32)
        padded[: len(at)] = at
        out = cv2.remap(
            self._picture, padded.reshape(side, 1024, 2), None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP
        )
        return out.reshape(-1, 3)[: len(at)]


def _blotches(rng: np.random.Generator, size: float) -> NDArray:
    """Smooth noise [1024, 1024] of unit variance, which repeats."""
    spectrum = np.fft.rfft2(rng.normal(size=(1024, 1024)))
    fv, fu = np.fft.fftfreq(1024)[:, None], np.fft.rfftfreq(1024)[None]
    noise = np.fft.irfft2(spectrum * np.exp(-2 * (np.pi * size) ** 2 * (fv**2 + fu**2)))
    return noise / noise.std()


@dataclass
class Faults:
    """What is not exact."""

    noise: tuple[float, float] = (0.0, 0.0)
    """Standard deviation of each pose, m and degrees."""
    drift: tuple[float, float] = (0.0, 0.0)
    """The same of an error that changes within a second or so."""
    hand_eye: tuple[float, float] = (0.0, 0.0)
    """Of an error that stays, m and degrees."""
    blur: float = 0.0
    """Exposure, s."""
    late: float = 0.0
    """Colour is taken so long after depth, s."""
    exposure: float = 0.0
    """Share by which everything becomes brighter and darker."""
    speed: tuple[float, float] = (0.10, 20.0)
    """Of the camera, m/s and degrees/s, at most times."""


def hand_held_film(
    table: str,
    boxes: str,
    faults: Faults,
    frames: int,
    seed: int,
    rate: float = 30.0,
    intrinsics: Intrinsics = VGA,
    distance: float = 1.2,
) -> Iterator[RecordedFrame]:
    """The film; its poses err, and nothing in it moves."""
    rng = np.random.default_rng(seed)
    textures = [Print(boxes, 100 * seed + k) for k in range(len(SIZES))]
    scene = DrawnScene(SIZES, textures, Print(table, seed), intrinsics)
    places = [planar(*place) for place in PLACES]
    way = _Way(faults.speed, distance, rng)
    stays, drifts = _error(faults.hand_eye, rng), np.zeros(6)
    for k in range(frames):
        t = k / rate
        times = t + faults.late + faults.blur * np.linspace(-0.5, 0.5, 4 if faults.blur else 1)
        seen = [scene.frame(k, way.at(moment), places)[0] for moment in times]
        color = np.mean([frame.color for frame in seen], axis=0)
        color *= 1 + faults.exposure * np.sin(2 * np.pi * t)
        color = np.clip(np.rint(color + rng.normal(0, 2.5, color.shape)), 0, 255).astype(np.uint8)
        X_WC = way.at(t)
        exact = seen[0].depth if not (faults.late or faults.blur) else scene.frame(k, X_WC, places)[0].depth
        kept = np.exp(-1 / rate)
        drifts = kept * drifts + np.sqrt(1 - kept**2) * _six(faults.drift, rng)
        error = stays @ _pose(drifts) @ _error(faults.noise, rng)
        depth = structured_light(exact.astype(float), intrinsics, rng).astype(np.float32)
        yield RecordedFrame(t, color, depth, X_WC @ error)


class _Way:
    """Where the camera is: a sum of slow waves around a place that looks at the table from beside."""

    def __init__(self, speed: tuple[float, float], distance: float, rng: np.random.Generator):
        self._frequencies = rng.uniform(0.3, 0.9, (6, 3))
        self._phases = rng.uniform(0, 2 * np.pi, (6, 3))
        peak = np.repeat([np.radians(speed[1]), speed[0]], 3) / np.sqrt(3)
        self._size = peak[:, None] / np.sqrt(3) / (2 * np.pi * self._frequencies)
        down = Rotation.from_euler("x", -np.pi / 2 - np.radians(45))
        self._middle = np.eye(4)
        self._middle[:3, :3] = down.as_matrix()
        self._middle[:3, 3] = -distance * self._middle[:3, 2]

    def at(self, t: float) -> NDArray:
        """X_WC at a time, s."""
        waves = (self._size * np.sin(2 * np.pi * self._frequencies * t + self._phases)).sum(1)
        return self._middle @ _pose(waves)


def _pose(six: NDArray) -> NDArray:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_rotvec(six[:3]).as_matrix()
    X[:3, 3] = six[3:]
    return X


def _six(sigma: tuple[float, float], rng: np.random.Generator) -> NDArray:
    return np.repeat([np.radians(sigma[1]), sigma[0]], 3) * rng.normal(size=6)


def _error(sigma: tuple[float, float], rng: np.random.Generator) -> NDArray:
    return _pose(_six(sigma, rng))
