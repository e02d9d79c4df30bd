"""The camera behind an emulated RealSense driver: pictures of the simulated world, and the truth in them."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder

from riseg_drake.geometry.camera import pixel_grid
from riseg_drake.stations.placed_object import object_id_table
from riseg_drake.stations.render_engine import make_render_engine
from riseg_drake.stations.simulated import RENDERER, SimulatedStationConfig, add_world, ideal_camera
from riseg_drake.stations.wrist_camera import CameraConfig, measured_images

FULL_WIDTH = 848
"""Width of the D415's pictures, px; a simulated station's are cropped to their middle."""
RAW_OFFSET = 0.015
"""How far the left infrared imager sits to the left of the colour camera of a D415, m."""


def full_picture(camera: CameraConfig) -> CameraConfig:
    """The camera whose picture, cropped to the middle, is that of `camera`."""
    return replace(camera, width=FULL_WIDTH, cx=camera.cx + (FULL_WIDTH - camera.width) / 2)


@dataclass(frozen=True)
class Picture:
    """What the camera sees in one instant, with noise."""

    color: NDArray[np.uint8]
    """[H, W, 3], RGB."""
    depth: NDArray[np.float32]
    """[H, W], m, aligned to colour, 0 = invalid."""
    raw_depth: NDArray[np.float32]
    """[H, W], m, as the left infrared camera sees it: not aligned."""


class EmulatedCamera:
    """Draws the world of an EmulatedArm of the same settings and seed, wherever its bodies are.

    Raises ValueError (SceneError) for settings that cannot be.
    """

    def __init__(self, config: SimulatedStationConfig, seed: int):
        self._camera = full_picture(config.camera)
        self._seed = seed
        builder = DiagramBuilder()
        world = add_world(builder, config, seed, config.time_step)
        world.scene_graph.AddRenderer(RENDERER, make_render_engine(config.renderer))
        self._plant = world.plant
        self._sensor = builder.AddSystem(ideal_camera(world.plant, world.panda.camera_frame, self._camera))
        builder.Connect(world.scene_graph.get_query_output_port(), self._sensor.query_object_input_port())
        self._table = object_id_table(world.object_bodies)
        self._bodies = {i: world.plant.get_body(index) for i, index in world.object_bodies.items()}
        self.names = {i: placed.name for i, placed in enumerate(world.objects, start=1)}
        """By object id."""
        self.axes = {i: placed.model.axes for i, placed in enumerate(world.objects, start=1)}
        """By object id, the unit vectors in B [k, 3] about which it is a body of revolution."""
        diagram = builder.Build()
        self._root = diagram.CreateDefaultContext()
        self._plant_context = world.plant.GetMyMutableContextFromRoot(self._root)
        self._context = self._sensor.GetMyContextFromRoot(self._root)

    def look(self, positions: NDArray) -> None:
        """Arrange the world by the positions [num_positions] of its plant."""
        self._plant.SetPositions(self._plant_context, positions)

    def picture(self, number: int) -> Picture:
        """The world as it is arranged; the noise depends on the seed and the picture's number alone."""
        color, depth = measured_images(
            self._sensor.color_image_output_port().Eval(self._context).data[..., :3],
            self._sensor.depth_image_32F_output_port().Eval(self._context).data[..., 0],
            self._camera,
            np.random.default_rng([self._seed, number]),
            self._sensor.body_pose_in_world_output_port().Eval(self._context).GetAsMatrix4(),
            self._seed,
        )
        return Picture(color, depth, seen_beside(depth, self._camera))

    def labels(self) -> NDArray[np.uint16]:
        """The true visible object ids [H, W] of the world as it is arranged."""
        seen = self._sensor.label_image_output_port().Eval(self._context).data[..., 0]
        return self._table[seen].astype(np.uint16)

    def object_poses(self) -> dict[int, RigidTransform]:
        """X_WBcm of each object id, of the world as it is arranged: B's axes in the centre of mass."""
        return {
            i: body.EvalPoseInWorld(self._plant_context) @ RigidTransform(body.default_com())
            for i, body in self._bodies.items()
        }


def seen_beside(depth: NDArray[np.float32], camera: CameraConfig) -> NDArray[np.float32]:
    """Depth [H, W] roughly as seen from RAW_OFFSET to the left, where everything is further to the right.

    Each pixel takes the value from where its own depth says that it would come from.
    """
    grid = pixel_grid(*depth.shape)
    with np.errstate(divide="ignore"):
        shift = np.where(depth > 0, camera.fx * RAW_OFFSET / depth, 0).astype(np.float32)
    return cv2.remap(depth, grid[..., 0] - shift, np.ascontiguousarray(grid[..., 1]), cv2.INTER_NEAREST)
