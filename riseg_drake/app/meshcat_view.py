"""What a person sees in the browser beside the robot and the scene: the push to come, and the objects found.

Drake's own MeshcatVisualizer shows robot and scene. A Meshcat recording keeps motions and properties but
not changing shapes, so what changes shape is drawn once a step under a name of its own, and the
recording keeps when it is visible.
"""

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.geometry import Cylinder, Meshcat, MeshcatCone, Rgba
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.perception import BaseField, Fields, PointCloud
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from riseg_drake.geometry.camera import back_project
from riseg_drake.geometry.rgbd import NO_PAIR, Frame, FramePair
from riseg_drake.pictures.object_colors import object_colors
from riseg_drake.pushing.push import NO_PUSH, Push
from riseg_drake.segmentation.segmentation import Segmentation, nothing_segmented

POINT_STRIDE = 3
"""Every third pixel in both directions becomes a point: 34 thousand at 640x480."""
POINT_SIZE = 0.0025  # m
ARROW_RADIUS = 0.004  # m
ARROW_RUN_UP = 0.08
"""How far ahead of the contact the arrow begins, m."""
ARROW_COLOR = Rgba(0.84, 0.37, 0.0, 1.0)


class MeshcatView(LeafSystem):
    """Draws the point cloud coloured by object id, and the push that is under way as an arrow.

    Inputs: `pair` (FramePair), `segmentation` (Segmentation), `active_push` (Push),
    `interaction_step` (int). Looks every `period` s.
    """

    def __init__(self, meshcat: Meshcat, period: float):
        super().__init__()
        self.set_name("MeshcatView")
        self._meshcat = meshcat
        self._visible: dict[str, str] = {}  # by kind ("points", "push"), the path that is shown now
        self._sequence = -1
        self._push = NO_PUSH
        for name, model in (
            ("pair", NO_PAIR),
            ("segmentation", nothing_segmented((0, 0))),
            ("active_push", NO_PUSH),
            ("interaction_step", 0),
        ):
            self.DeclareAbstractInputPort(name, AbstractValue.Make(model))
        self.DeclarePeriodicPublishEvent(period, 0.0, self._publish)

    def _publish(self, context: Context) -> EventStatus:
        pair: FramePair = self.GetInputPort("pair").Eval(context)
        segmentation: Segmentation = self.GetInputPort("segmentation").Eval(context)
        step: int = self.GetInputPort("interaction_step").Eval(context)
        # At a tick both are of the frame before; a pair without its mask yet is left for the next tick.
        if self._sequence != pair.current.sequence == segmentation.sequence:
            self._sequence = segmentation.sequence
            path = f"/riseg/points/step_{step}"
            self._meshcat.SetObject(path, object_cloud(pair.current, segmentation.mask), POINT_SIZE)
            self._turn_to("points", path, context.get_time())
        push: Push = self.GetInputPort("active_push").Eval(context)
        if push is not self._push:
            self._push = push
            path = f"/riseg/push/step_{step}" if push is not NO_PUSH else ""
            if push is not NO_PUSH:
                draw_arrow(self._meshcat, path, push)
            self._turn_to("push", path, context.get_time())
        return EventStatus.Succeeded()

    def _turn_to(self, kind: str, path: str, time: float) -> None:
        """Show one path of a kind instead of the one that was shown until now."""
        before = self._visible.get(kind, "")
        if path == before:
            return
        if before:
            self._meshcat.SetProperty(before, "visible", False, time)
        if path:
            if time > 0:  # in the replay it is not there from the beginning
                self._meshcat.SetProperty(path, "visible", False, 0.0)
            self._meshcat.SetProperty(path, "visible", True, time)
        self._visible[kind] = path


def object_cloud(frame: Frame, mask: NDArray) -> PointCloud:
    """The frame's points in W, by its mask [H, W] in the colours of object ids, else as the camera saw them."""
    stride = (slice(None, None, POINT_STRIDE), slice(None, None, POINT_STRIDE))
    p_CQ = back_project(frame.depth, frame.intrinsics)[stride].reshape(-1, 3)
    ids = mask[stride].ravel()
    colors = np.where(ids[:, None] > 0, object_colors(ids), frame.color[stride].reshape(-1, 3))
    seen = (p_CQ[:, 2] > 0) & ~frame.robot[stride].ravel()
    p_WQ = p_CQ[seen] @ frame.X_WC[:3, :3].T + frame.X_WC[:3, 3]

    cloud = PointCloud(int(seen.sum()), Fields(BaseField.kXYZs | BaseField.kRGBs))
    cloud.mutable_xyzs()[:] = p_WQ.T
    cloud.mutable_rgbs()[:] = colors[seen].T
    return cloud


def draw_arrow(meshcat: Meshcat, path: str, push: Push) -> None:
    """An arrow through the contact, along the push, to where the contact will be at its end."""
    direction_W = np.array([*push.direction_W, 0.0])
    tail, tip = push.p_WB - ARROW_RUN_UP * direction_W, push.p_WB + push.d_push * direction_W
    head = 4 * ARROW_RADIUS
    shaft = float(np.linalg.norm(tip - tail)) - head
    # The cylinder lies about its middle; the cone's point is its origin and it opens along its z axis.
    along = RotationMatrix.MakeFromOneVector(direction_W, 2)
    against = RotationMatrix.MakeFromOneVector(-direction_W, 2)
    meshcat.SetObject(f"{path}/shaft", Cylinder(ARROW_RADIUS, shaft), ARROW_COLOR)
    meshcat.SetTransform(f"{path}/shaft", RigidTransform(along, tail + shaft / 2 * direction_W))
    meshcat.SetObject(f"{path}/head", MeshcatCone(head, head / 2, head / 2), ARROW_COLOR)
    meshcat.SetTransform(f"{path}/head", RigidTransform(against, tip))
