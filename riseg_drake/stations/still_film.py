"""Films of a scene that nobody touches, by the simulated camera in a hand: all errs that can, nothing moves."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineVtk,
    RenderCameraCore,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from riseg_drake.geometry.rgbd import sanitize_depth
from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.stations.sensor_noise import every_depth_error
from riseg_drake.stations.simulated import CLIPPING, RENDERER, SimulatedStationConfig, add_world
from riseg_drake.stations.wrist_camera import CameraConfig, measured_images

ARM_ASIDE = [2.8, -1.2, 0.0, -2.4, 0.0, 1.6, 0.8]
"""Joint angles, rad, with which the arm is behind its own base."""


@dataclass
class StillFilmParameters:
    """What is filmed, and how."""

    camera: CameraConfig = field(default_factory=lambda: CameraConfig(noise=every_depth_error()))
    frames: int = 45
    """At the camera's rate."""
    distance: float = 0.55
    """m from the middle of the scene."""
    steepest: float = 80.0
    """degrees; the camera looks down at an angle of at most that,"""
    flattest: float = 40.0
    """degrees; and at least that, drawn for each film."""
    sway: float = 0.04
    """m by which the hand sways to each side, in a second or two."""
    turn: float = 0.02
    """rad by which it does not aim at the middle."""
    pose_turn_std: float = 0.001
    """rad; standard deviation of the recorded poses' error about each axis: what visual odometry reaches,"""
    pose_shift_std: float = 0.0007
    """and along each axis, m."""


def still_film(parameters: StillFilmParameters, seed: int) -> Iterator[RecordedFrame]:
    """The frames of one film: a scene drawn from the seed, at rest, with true labels and poses that err.

    The arm is put aside. Raises SceneError where no scene can be drawn.
    """
    camera = parameters.camera
    config = SimulatedStationConfig(camera=camera, start_position=ARM_ASIDE)
    builder = DiagramBuilder()
    world = add_world(builder, config, seed, config.time_step)
    world.scene_graph.AddRenderer(RENDERER, MakeRenderEngineVtk(config.renderer))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    query = world.scene_graph.get_query_output_port().Eval(world.scene_graph.GetMyContextFromRoot(context))
    info = CameraInfo(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    core = RenderCameraCore(RENDERER, info, ClippingRange(*CLIPPING), RigidTransform())
    color_camera, depth_camera = ColorRenderCamera(core), DepthRenderCamera(core, DepthRange(*CLIPPING))
    table = np.zeros(2**15, np.uint16)
    for object_id, body in world.object_bodies.items():
        table[int(body)] = object_id
    rng = np.random.default_rng([seed, parameters.frames])
    origin = world.scene_graph.world_frame_id()
    middle = np.array([*config.scene.centre_W, 0.02])
    for number, X_WC in enumerate(hand_path(parameters, middle, rng)):
        color = query.RenderColorImage(color_camera, origin, X_WC).data[..., :3]
        depth = sanitize_depth(query.RenderDepthImage(depth_camera, origin, X_WC).data[..., 0])
        label = table[query.RenderLabelImage(color_camera, origin, X_WC).data[..., 0]]
        true = X_WC.GetAsMatrix4()
        noise = np.random.default_rng([seed, number])
        seen, measured = measured_images(color, depth, camera, noise, true, seed)
        sigma = np.repeat([parameters.pose_turn_std, parameters.pose_shift_std], 3)
        yield RecordedFrame(
            time=number / camera.rate,
            color=seen,
            depth=measured,
            X_WC=true @ exp_se3(sigma * noise.normal(size=6)),
            labels=label,
        )


def hand_path(
    parameters: StillFilmParameters, middle: NDArray[np.float64], rng: np.random.Generator
) -> Iterator[RigidTransform]:
    """Poses X_WC of a camera in a hand that looks at a point [3], from left or right, away from the arm."""
    elevation = np.radians(rng.uniform(parameters.flattest, parameters.steepest))
    azimuth = rng.choice([-1, 1]) * np.radians(rng.uniform(90, 125))
    away = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    rest = middle + parameters.distance * np.array(away)
    # Each axis sways in three waves of a second to three.
    period, phase = rng.uniform(1.0, 3.0, (6, 3)), rng.uniform(0, 2 * np.pi, (6, 3))
    for number in range(parameters.frames):
        wave = np.sin(2 * np.pi * number / parameters.camera.rate / period + phase).mean(1)
        eye = rest + parameters.sway * wave[:3]
        z = middle - eye
        z /= np.linalg.norm(z)
        x = np.cross(z, [0, 0, 1.0])
        x /= np.linalg.norm(x)
        X_WC = RigidTransform(RotationMatrix(np.column_stack([x, np.cross(z, x), z])), eye)
        aim = exp_se3(np.concatenate([parameters.turn * wave[3:], np.zeros(3)]))
        yield X_WC @ RigidTransform(aim)
