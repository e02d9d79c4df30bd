"""Right films of a table, which tests then make wrong: a camera in a hand, two boxes, nothing moves."""

from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from riseg_drake.geometry.rgbd import Frame
from tests.segmentation.drawn_scene import DrawnScene, Texture, looking_down, planar

FRAMES = 14


def hand_held(frames=FRAMES, still=False, distance=0.45, boxes=((0.09, 0.08, 0.04), (0.07, 0.09, 0.05))):
    """Frames of 320x240 with right poses; seen by a camera that stands still, if asked for."""
    scene = DrawnScene(list(boxes), table=Texture(9, contrast=20))
    rng = np.random.default_rng(0)
    film = []
    for k in range(frames):
        t = 0 if still else k
        wander = RigidTransform(
            RollPitchYaw(0.004 * t, -0.003 * t, 0.006 * t), [0.003 * t, 0.002 * t, 0.001 * t]
        )
        X_WC = looking_down(z=distance) @ wander.GetAsMatrix4()
        frame, _ = scene.frame(k, X_WC, [planar(-0.07, 0.0, 0.3), planar(0.07, 0.0)][: len(boxes)], rng)
        film.append(frame)
    return film


def reader(film):
    return lambda number: film[number]


def with_poses(film, written) -> list[Frame]:
    return [replace(frame, X_WC=written(k, frame.X_WC)) for k, frame in enumerate(film)]
