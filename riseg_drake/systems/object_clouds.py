"""L_t in Drake's own types, for planners that go on with it: a label image, and the cloud of each object."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.perception import BaseField, Fields, PointCloud
from pydrake.systems.framework import Context, LeafSystem
from pydrake.systems.sensors import ImageLabel16I

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.se3 import move_points
from riseg_drake.segmentation.segmentation import Segmentation, nothing_segmented
from riseg_drake.systems.value_input import ValueInput


class ObjectClouds(LeafSystem):
    """What a frame shows of each object, worked out when it is asked for.

    Inputs:
        segmentation: Segmentation.

    Outputs:
        label_image: ImageLabel16I, L_t, 0 = background.
        object_clouds: dict of PointCloud by id, p_WQ in metres with colours; of pixels with depth only.
    """

    def __init__(self, intrinsics: Intrinsics) -> None:
        super().__init__()
        self.set_name("ObjectClouds")
        self._segmentation = ValueInput(self, "segmentation", nothing_segmented(intrinsics.shape))
        blank = ImageLabel16I(intrinsics.width, intrinsics.height)
        self._declare("label_image", blank, label_image)
        self._declare("object_clouds", {}, object_clouds)

    def _declare(self, name: str, model: Any, made_of: Callable[[Segmentation], Any]) -> None:
        def calc(context: Context, output: AbstractValue) -> None:
            output.set_value(made_of(self._segmentation.Eval(context)))

        self.DeclareAbstractOutputPort(
            name, AbstractValue.Make(model).Clone, calc, prerequisites_of_calc={self.all_input_ports_ticket()}
        )


def label_image(segmentation: Segmentation) -> ImageLabel16I:
    """L_t as Drake's image of labels."""
    mask = segmentation.mask
    image = ImageLabel16I(mask.shape[1], mask.shape[0])
    image.mutable_data[..., 0] = mask
    return image


def object_clouds(segmentation: Segmentation) -> dict[int, PointCloud]:
    """By id, the points p_WQ in metres, with colours, of what the last frame shows."""
    frame, mask = segmentation.frame, segmentation.mask
    if frame is None:
        return {}
    clouds = {}
    for object_id in np.unique(mask[mask > 0]).tolist():
        seen = (mask == object_id) & (frame.depth > 0)
        p_CQ = rays(frame.intrinsics)[seen].astype(float) * frame.depth[seen, None]
        cloud = PointCloud(len(p_CQ), Fields(BaseField.kXYZs | BaseField.kRGBs))
        cloud.mutable_xyzs()[:] = move_points(frame.X_WC, p_CQ).T
        cloud.mutable_rgbs()[:] = frame.color[seen].T
        clouds[object_id] = cloud
    return clouds
