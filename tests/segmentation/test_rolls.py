"""What is round may roll: axes from normals, and the motions about them."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RotationMatrix

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.segmentation.belief import BeliefParameters
from riseg_drake.segmentation.motion_search import MotionSearchParameters, SearchProblem, search_motions
from riseg_drake.segmentation.motions import flow_difference
from riseg_drake.segmentation.observation import ObservationParameters
from riseg_drake.segmentation.recognition import RecognitionParameters
from riseg_drake.segmentation.rolls import RollingAxis, rolling_axes, rolls, surface_normals
from tests.segmentation.drawn_scene import first_compared, looking_down, standing

NONE = np.empty((0, 4, 4))

CAMERA = Intrinsics(200, 160, 300.0, 300.0, 99.5, 79.5)
UP = np.array([0.0, 0.0, -1.0])
"""The camera looks straight down at a table 0.5 m away."""
AXIS, MIDDLE, RADIUS = np.array([0.8, 0.6, 0.0]), np.array([0.01, -0.02, 0.465]), 0.035
"""A can on it, m."""


def seen(depth):
    """A frame of a depth image [H, W]."""
    return Frame(
        0, 0.0, CAMERA, np.zeros((*depth.shape, 3), np.uint8), depth.astype(np.float32), np.eye(4), depth < 0
    )


def can(noise=0.0):
    """Depth of the lying can, 12 cm long, and where it is seen."""
    r = rays(CAMERA).astype(float)
    across = r - (r @ AXIS)[..., None] * AXIS
    m = MIDDLE - (MIDDLE @ AXIS) * AXIS
    a, b, c = (across**2).sum(-1), across @ m, m @ m - RADIUS**2
    z = (b - np.sqrt(np.maximum(b**2 - a * c, 0))) / a
    mask = (b**2 > 1.001 * a * c) & (np.abs((r * z[..., None]) @ AXIS - MIDDLE @ AXIS) < 0.06)
    return np.where(mask, z, 0.5) + noise * np.random.default_rng(0).normal(size=z.shape), mask


def ball():
    """Depth of a ball of that radius, and where it is seen."""
    r = rays(CAMERA).astype(float)
    a, b, c = (r**2).sum(-1), r @ MIDDLE, MIDDLE @ MIDDLE - RADIUS**2
    mask = b**2 > 1.001 * a * c
    return np.where(mask, (b - np.sqrt(np.maximum(b**2 - a * c, 0))) / a, 0.5), mask


def roof(slope):
    """Depth of two planes that meet in a ridge, and where they are looked at."""
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    per_depth = 1 / 0.45 - slope * np.abs(u - CAMERA.cx) / CAMERA.fx
    return 1 / per_depth, (np.abs(u - CAMERA.cx) < 40) & (np.abs(v - CAMERA.cy) < 40)


def asked(depth, mask):
    """Every so many points of a surface, and their normals."""
    v, u = (index[::7] for index in np.nonzero(mask))
    return rays(CAMERA)[v, u] * depth[v, u][:, None], surface_normals(seen(depth), mask, v, u)


def test_the_normals_of_a_slanting_plane_are_its_own():
    plane = np.array([0.3, -0.2, -1.0]) / np.linalg.norm([0.3, -0.2, -1.0])
    depth = 0.5 * plane[2] / (rays(CAMERA) @ plane)
    _, normals = asked(depth, np.ones(depth.shape, bool))
    np.testing.assert_allclose(normals, np.tile(plane, (len(normals), 1)), atol=1e-4)


def test_the_normals_of_a_can_point_away_from_its_axis():
    depth, mask = can()
    points, normals = asked(depth, mask)
    out = points - MIDDLE
    out -= np.outer(out @ AXIS, AXIS)
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    # A chord of the window leans as the middle of its arc does, but at the rim, where the window ends early.
    assert np.median(np.degrees(np.arccos(np.clip((normals * out).sum(1), -1, 1)))) < 1.5


@pytest.mark.parametrize("noise", [0.0, 0.0005])
def test_a_lying_can_rolls_about_its_own_axis_and_no_other(noise):
    (axis,) = rolling_axes(*asked(*can(noise)), UP)
    assert abs(axis.direction @ AXIS) > np.cos(0.05)
    apart = axis.point - MIDDLE
    assert np.linalg.norm(apart - (apart @ AXIS) * AXIS) < 0.003


def test_part_of_a_can_tells_its_axis_as_well():
    depth, mask = can()
    v, u = np.mgrid[: mask.shape[0], : mask.shape[1]]
    (axis,) = rolling_axes(*asked(depth, mask & (np.hypot(v - 75, u - 100) < 18)), UP)
    assert abs(axis.direction @ AXIS) > np.cos(0.1)


def test_a_ball_rolls_about_two_axes_through_its_middle():
    axes = rolling_axes(*asked(*ball()), UP)
    assert len(axes) == 2
    assert abs(axes[0].direction @ axes[1].direction) < 0.2
    for axis in axes:
        assert abs(axis.direction @ UP) < 1e-9
        apart = axis.point - MIDDLE
        assert np.linalg.norm(apart - (apart @ axis.direction) * axis.direction) < 0.003


def test_what_is_flat_or_has_an_edge_does_not_roll():
    for slope in (0.0, 2.0, 5.0):
        assert rolling_axes(*asked(*roof(slope)), UP) == []


def test_a_standing_can_does_not_roll():
    """Seen from the side: its axis is across the table, and about its own normal its wall does not roll."""
    depth, mask = can()
    assert rolling_axes(*asked(depth, mask), AXIS) == []


def test_rolls_turn_about_the_axis_and_shift_along_and_across_it():
    axis = RollingAxis(AXIS, MIDDLE)
    amounts = np.array([[0.0, 0.0, 0.0], [0.01, 0.02, 0.0], [0.003, -0.004, 0.4]])
    motions = rolls(axis, UP, amounts)
    np.testing.assert_allclose(motions[0], np.eye(4), atol=1e-15)
    for X, (along, forward, angle) in zip(motions, amounts, strict=True):
        np.testing.assert_allclose(X[:3, :3], RotationMatrix(AngleAxis(angle, AXIS)).matrix(), atol=1e-12)
        shift = X[:3, :3] @ MIDDLE + X[:3, 3] - MIDDLE
        np.testing.assert_allclose(shift, along * AXIS + forward * np.cross(UP, AXIS), atol=1e-12)


def printed_can(turn, size=(320, 240)):
    """A frame of a can, lit from one side, of which a pattern has turned about its axis, rad; where it is seen.

    A camera over the table, 0.5 m away.
    """
    camera = Intrinsics(*size, 300.0, 300.0, 159.5, 119.5)
    r = rays(camera).astype(float)
    across, m = r - (r @ AXIS)[..., None] * AXIS, MIDDLE - (MIDDLE @ AXIS) * AXIS
    a, b, c = (across**2).sum(-1), across @ m, m @ m - RADIUS**2
    hit = b**2 > a * c
    z = np.where(hit, (b - np.sqrt(np.maximum(b**2 - a * c, 0))) / a, 0.5)
    p = r * z[..., None] - MIDDLE
    mask = hit & (np.abs(p @ AXIS) < 0.06)
    side = np.cross(AXIS, UP)
    angle = np.arctan2(p @ side, p @ UP) - turn
    # A motion about AXIS by `turn` takes what is printed at an angle to that angle and `turn`.
    rng = np.random.default_rng(1)
    waves = rng.uniform(-1, 1, (12, 2)) * [14, 400], rng.uniform(0, 6.3, 12)
    print_ = sum(np.sin(k * angle + f * (p @ AXIS) + e) for (k, f), e in zip(*waves, strict=True))
    light = 0.6 + 0.4 * np.clip(p @ (side + UP) / RADIUS / np.sqrt(2), 0, 1)
    rng = np.random.default_rng(2)
    gray = np.where(mask, light * (130 + 25 * print_), 150) + 2 * rng.normal(size=z.shape)
    depth = np.where(mask, z, 0.5) + 0.0006 * rng.normal(size=z.shape)
    color = np.repeat(np.clip(gray, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    X_WC = looking_down(z=0.5)
    return Frame(0, turn, camera, color, depth.astype(np.float32), X_WC, np.zeros(z.shape, bool)), mask


@pytest.mark.parametrize("turn", [0.35, 0.4, 0.45, -0.4])
def test_a_can_that_has_rolled_where_it_lies_is_found_by_what_is_printed_on_it(turn):
    (before, mask), (after, _) = printed_can(0.0), printed_can(turn)
    belief, compared = first_compared(FramePair(before, replace(after, sequence=1)), mask.astype(np.uint16))
    observation = ObservationParameters()

    def nearest(parameters):
        problem = SearchProblem(
            compared,
            standing(after, mask),
            np.vstack([belief.part[None], belief.finer]),
            observation.motion_cost,
            parameters,
            observation.likelihood,
            BeliefParameters().partition.area_min,
        )
        true = rolls(RollingAxis(AXIS, MIDDLE), UP, np.array([[0.0, 0.0, turn]]))[0]
        points = compared.keyframe.edges.p_C0Q
        return min(flow_difference(points, X, true, 300.0) for X in (np.eye(4), *search_motions(problem, NONE)))

    assert nearest(MotionSearchParameters(recognition=RecognitionParameters(most=0))) < 1.0
    without = MotionSearchParameters(roll=0.0, recognition=RecognitionParameters(most=0))
    assert nearest(without) > 3.0
