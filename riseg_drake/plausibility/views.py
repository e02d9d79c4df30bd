"""Frames made small for a first look, and the table in them."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.reduction import mean_of_each, one_of_each, reduced_intrinsics
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.above_table import AboveTable, AboveTableParameters, objects_above_table
from riseg_drake.segmentation.table_plane import NoPlaneError

_TEXTURE = 2.5
"""Least gradient, gray values a pixel, of a pixel at which optical flow is believed."""
_BORDER = 4
"""Pixels along the image's border at which flow is not believed."""
_RETURN = 0.5
"""Pixels by which flow there and back may miss where it began."""
_CONTINUED = 3.0
"""Standard deviations of depth within which a pixel is table."""


@dataclass(frozen=True)
class View:
    """A frame and what stands on its table; None where no table is to be seen."""

    frame: Frame
    above: AboveTable | None

    def table(self) -> NDArray[np.bool_]:
        """[H, W]: pixels that surely see the table."""
        if self.above is None:
            return np.zeros(self.frame.depth.shape, bool)
        with np.errstate(invalid="ignore"):
            near = np.abs(self.above.height) < _CONTINUED * self.above.depth_noise * self.frame.depth**2
        return near & ~self.above.mask & ~self.frame.robot


def small_view(frame: Frame, width: int) -> View:
    """The view of a frame that is made at most `width` pixels wide, by a whole number."""
    step = -(-frame.intrinsics.width // width)
    small = _smaller(frame, step) if step > 1 else frame
    try:
        return View(small, objects_above_table(small, AboveTableParameters()))
    except NoPlaneError:
        return View(small, None)


def agreed_flow(first: Frame, second: Frame) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Flow O [H, W, 2], pixels, from one image to another, and where [H, W] it is to be believed: there is
    texture, and flow back leads to where it began."""
    dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
    gray_0, gray_1 = (cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY) for frame in (first, second))
    flow, back = dis.calc(gray_0, gray_1, None), dis.calc(gray_1, gray_0, None)
    height, width = gray_0.shape
    v, u = np.mgrid[:height, :width].astype(np.float32)
    there_u, there_v = u + flow[..., 0], v + flow[..., 1]
    returned = cv2.remap(back, there_u, there_v, cv2.INTER_LINEAR) + flow
    inside = (there_u > 0) & (there_u < width - 1) & (there_v > 0) & (there_v < height - 1)
    good = inside & (np.linalg.norm(returned, axis=-1) < _RETURN) & (first.gradient_squared > _TEXTURE**2)
    good[:_BORDER] = good[-_BORDER:] = good[:, :_BORDER] = good[:, -_BORDER:] = False
    return flow, good & ~first.robot


def _smaller(frame: Frame, step: int) -> Frame:
    return replace(
        frame,
        intrinsics=reduced_intrinsics(frame.intrinsics, step),
        color=mean_of_each(frame.color, step),
        depth=np.ascontiguousarray(one_of_each(frame.depth, step)),
        robot=np.ascontiguousarray(one_of_each(frame.robot, step)),
    )
