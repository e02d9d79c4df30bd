"""Films of a scene that nobody touches, by the simulated camera in a hand: all errs that can, nothing moves."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform

from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.stations.filmed_world import FilmedWorld, looking_at
from riseg_drake.stations.scene import SceneConfig
from riseg_drake.stations.sensor_noise import every_depth_error
from riseg_drake.stations.wrist_camera import CameraConfig


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

    Raises SceneError where no scene can be drawn.
    """
    camera = parameters.camera
    world = FilmedWorld(camera, seed)
    rng = np.random.default_rng([seed, parameters.frames])
    middle = np.array([*SceneConfig().centre_W, 0.02])
    sigma = np.repeat([parameters.pose_turn_std, parameters.pose_shift_std], 3)
    for number, X_WC in enumerate(hand_path(parameters, middle, rng)):
        noise = np.random.default_rng([seed, number])
        color, depth, label = world.look(X_WC, noise)
        yield RecordedFrame(
            time=number / camera.rate,
            color=color,
            depth=depth,
            X_WC=X_WC.GetAsMatrix4() @ exp_se3(sigma * noise.normal(size=6)),
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
        aim = exp_se3(np.concatenate([parameters.turn * wave[3:], np.zeros(3)]))
        yield looking_at(eye, middle) @ RigidTransform(aim)
