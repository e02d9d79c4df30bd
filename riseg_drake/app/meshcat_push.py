"""A push as it stands in Meshcat's scene: an arrow, and what the tool's tip sweeps on the table."""

import numpy as np
from pydrake.geometry import Box, Cylinder, Meshcat, MeshcatCone, Rgba
from pydrake.math import RigidTransform, RotationMatrix

from riseg_drake.pushing.push import Push
from riseg_drake.robot.tool_shape import ToolShape

ARROW_RADIUS = 0.004  # m
ARROW_RUN_UP = 0.08
"""How far ahead of the contact the arrow begins, m."""
ARROW_LIFT = 0.05
"""How far above the contact it is drawn, m: within an object nobody would see it."""
PUSH_COLOR = Rgba(0.84, 0.37, 0.0, 1.0)
SWEPT_COLOR = Rgba(0.84, 0.37, 0.0, 0.4)
SWEPT_THICKNESS = 0.001
"""Of what is drawn on the table, m."""


def draw_push(meshcat: Meshcat, path: str, push: Push, tool: ToolShape) -> None:
    """The push as an arrow at `path`/arrow, and the rectangle that the tip sweeps at `path`/swept."""
    draw_arrow(meshcat, f"{path}/arrow", push)
    draw_swept(meshcat, f"{path}/swept", push, tool)


def draw_arrow(meshcat: Meshcat, path: str, push: Push) -> None:
    """An arrow above the contact, along the push, to where the contact will be at its end."""
    direction_W = np.array([*push.direction_W, 0.0])
    p_WB = push.p_WB + np.array([0.0, 0.0, ARROW_LIFT])
    tail, tip = p_WB - ARROW_RUN_UP * direction_W, p_WB + push.d_push * direction_W
    head = 5 * ARROW_RADIUS
    shaft = float(np.linalg.norm(tip - tail)) - head
    # The cylinder lies about its middle; the cone's point is its origin and it opens along its z axis.
    along = RotationMatrix.MakeFromOneVector(direction_W, 2)
    against = RotationMatrix.MakeFromOneVector(-direction_W, 2)
    meshcat.SetObject(f"{path}/shaft", Cylinder(ARROW_RADIUS, shaft), PUSH_COLOR)
    meshcat.SetTransform(f"{path}/shaft", RigidTransform(along, tail + shaft / 2 * direction_W))
    meshcat.SetObject(f"{path}/head", MeshcatCone(head, head / 2, head / 2), PUSH_COLOR)
    meshcat.SetTransform(f"{path}/head", RigidTransform(against, tip))


def draw_swept(meshcat: Meshcat, path: str, push: Push, tool: ToolShape) -> None:
    """The rectangle under which the tip goes forward, from behind its first to before its last place."""
    forward, sideward = push.direction_W, np.array([-push.direction_W[1], push.direction_W[0]])
    middle = push.p_WE[:2] + push.length / 2 * forward
    below = push.p_WE[2] - push.tip_height + SWEPT_THICKNESS
    X_WS = np.eye(4)
    X_WS[:2, 0], X_WS[:2, 1], X_WS[:3, 3] = forward, sideward, [*middle, below]
    meshcat.SetObject(path, Box(push.length + tool.thickness, tool.width, SWEPT_THICKNESS), SWEPT_COLOR)
    meshcat.SetTransform(path, RigidTransform(X_WS))
