"""One RGB-D image of one pinhole, out of two images of two lenses."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.depth_alignment import align_depth
from riseg_drake.geometry.lens import COEFFICIENTS, FISHEYE_COEFFICIENTS, Lens
from riseg_drake.recording.layout import RecordingError, camera_from_json, pose_from_numbers


@dataclass(frozen=True)
class Registration:
    """How the images of a recording become those of the colour camera without its distortion."""

    color: Lens
    depth: Lens | None = None
    """The depth camera; None where depth is aligned to colour already."""
    X_CD: NDArray[np.float64] | None = None
    """Its pose in the colour camera, [4, 4]."""

    @property
    def intrinsics(self) -> Intrinsics:
        """Of the images that come out."""
        return self.color.intrinsics

    @property
    def depth_shape(self) -> tuple[int, int]:
        """(height, width) of the depth images that go in."""
        return (self.depth or self.color).intrinsics.shape

    def registered_color(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """A colour image [H, W, 3] without distortion."""
        return self.color.undistorted(image)

    def registered_depth(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Depth [H, W], m, 0 = invalid, for the pixels of the colour image."""
        if self.depth is None:
            return self.color.undistorted(depth, nearest=True)
        assert self.X_CD is not None
        return align_depth(depth, self.depth, self.X_CD, self.intrinsics)

    def registered_mask(self, image: NDArray[np.uint16]) -> NDArray[np.uint16]:
        """Ids [H, W] of the pixels of the colour image, without distortion."""
        return self.color.undistorted(image, nearest=True)


def registration_from_json(content: dict[str, Any], intrinsics: Intrinsics) -> Registration:
    """What camera.json says beside the intrinsics: "distortion", and "depth" where that is a camera of its own.

    "depth" holds the keys of the file itself without the scale, and "X_CD", its pose in the colour camera, as
    tx ty tz qx qy qz qw. Raises RecordingError, without the file's name.
    """
    color = lens_of(
        intrinsics, _numbers(content, "distortion", ()), fisheye=bool(content.get("fisheye", False))
    )
    if "depth" not in content:
        return Registration(color)
    depth = content["depth"]
    if not isinstance(depth, dict):
        raise RecordingError('"depth" must be an object with the keys of a camera, and "X_CD"')
    try:
        own, _ = camera_from_json({**depth, "depth_scale": content["depth_scale"]})
        lens = lens_of(own, _numbers(depth, "distortion", ()), fisheye=bool(depth.get("fisheye", False)))
    except RecordingError as error:
        raise RecordingError(f'"depth": {error}') from None
    pose = np.array(_numbers(depth, "X_CD", None))
    if pose.shape != (7,) or abs(np.linalg.norm(pose[3:]) - 1) > 0.01:
        raise RecordingError(
            '"X_CD" of "depth" must hold tx ty tz (m) qx qy qz qw (of length 1): its pose in the colour camera'
        )
    return Registration(color, lens, pose_from_numbers(pose))


def lens_of(intrinsics: Intrinsics, distortion: tuple[float, ...], *, fisheye: bool = False) -> Lens:
    """A lens with OpenCV's coefficients. Raises RecordingError for another number of them."""
    right = (0, FISHEYE_COEFFICIENTS) if fisheye else COEFFICIENTS
    if len(distortion) not in right:
        raise RecordingError(
            f'"distortion" holds {len(distortion)} numbers; OpenCV knows {", ".join(map(str, right))}'
        )
    return Lens(intrinsics, distortion, fisheye)


def _numbers(content: dict[str, Any], key: str, default: tuple[float, ...] | None) -> tuple[float, ...]:
    values = content.get(key, default)
    if not isinstance(values, list | tuple) or not all(
        isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < 1e9 for v in values
    ):
        raise RecordingError(f'"{key}" must be a list of numbers')
    return tuple(float(v) for v in values)
