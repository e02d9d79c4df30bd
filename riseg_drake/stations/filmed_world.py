"""A world that stands as it is put, before a camera that is held wherever one likes: no arm, no physics."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    RenderCameraCore,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from riseg_drake.geometry.rgbd import sanitize_depth
from riseg_drake.stations.placed_object import PlacedObject, object_id_table
from riseg_drake.stations.render_engine import make_render_engine
from riseg_drake.stations.simulated import CLIPPING, RENDERER, SimulatedStationConfig, add_world
from riseg_drake.stations.wrist_camera import CameraConfig, measured_images

ARM_ASIDE = [2.8, -1.2, 0.0, -2.4, 0.0, 1.6, 0.8]
"""Joint angles, rad, with which the arm is behind its own base."""


class FilmedWorld:
    """The world of a simulated station, its arm put aside, and a camera with all its errors."""

    def __init__(self, camera: CameraConfig, seed: int, objects: Sequence[PlacedObject] | None = None) -> None:
        """The scene that a station would draw from the seed, or `objects`. Raises SceneError."""
        self._camera, self._seed = camera, seed
        config = SimulatedStationConfig(camera=camera, start_position=ARM_ASIDE)
        builder = DiagramBuilder()
        self._world = add_world(builder, config, seed, config.time_step, objects)
        self._world.scene_graph.AddRenderer(RENDERER, make_render_engine(config.renderer))
        self._context = builder.Build().CreateDefaultContext()
        info = CameraInfo(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
        core = RenderCameraCore(RENDERER, info, ClippingRange(*CLIPPING), RigidTransform())
        self._color, self._depth = ColorRenderCamera(core), DepthRenderCamera(core, DepthRange(*CLIPPING))
        self._id_of = object_id_table(self._world.object_bodies)

    def put(self, X_WBs: Sequence[RigidTransform]) -> None:
        """Put object i + 1 where `X_WBs[i]` says."""
        plant = self._world.plant
        context = plant.GetMyMutableContextFromRoot(self._context)
        for index, X_WB in zip(self._world.object_bodies.values(), X_WBs, strict=True):
            plant.SetFreeBodyPose(context, plant.get_body(index), X_WB)

    def look(
        self, X_WC: RigidTransform, rng: np.random.Generator
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.uint16]]:
        """Colour [H, W, 3], depth [H, W], m, and true object ids [H, W] from a pose; `rng` draws the noise."""
        graph = self._world.scene_graph
        query = graph.get_query_output_port().Eval(graph.GetMyContextFromRoot(self._context))
        W = graph.world_frame_id()
        color = query.RenderColorImage(self._color, W, X_WC).data[..., :3]
        depth = sanitize_depth(query.RenderDepthImage(self._depth, W, X_WC).data[..., 0])
        label = self._id_of[query.RenderLabelImage(self._color, W, X_WC).data[..., 0]].astype(np.uint16)
        seen, measured = measured_images(color, depth, self._camera, rng, X_WC.GetAsMatrix4(), self._seed)
        return seen, measured, label


def looking_at(eye_W: NDArray, target_W: NDArray) -> RigidTransform:
    """X_WC of a camera at `eye_W` [3] that looks at `target_W` [3], the world's z up in its image."""
    ahead = (target_W - eye_W) / np.linalg.norm(target_W - eye_W)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return RigidTransform(RotationMatrix(np.column_stack([right, np.cross(ahead, right), ahead])), eye_W)
