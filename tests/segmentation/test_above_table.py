"""objMask on drawn depth: what stands there is found, and neither the table nor the robot."""

import zlib
from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.above_table import (
    AboveTableParameters,
    _colored_like_things,
    _depth_noise,
    _enclosed,
    _high,
    _without_specks,
    objects_above_table,
)
from tests.segmentation.drawn_room import KINDS, draw_room
from tests.segmentation.drawn_scene import CAMERA, DrawnScene, Texture, looking_down, planar

LOW_BOXES = [(0.06, 0.05, 0.015), (0.05, 0.08, 0.015), (0.04, 0.04, 0.05)]
PLACES = [planar(-0.08, 0.02, 0.4), planar(0.03, 0.02), planar(0.09, -0.06, 1.0)]


@pytest.mark.parametrize("tilt", [-0.25, 0.0, 0.25])
def test_things_of_15_mm_are_found_whole_and_the_table_is_not(tilt: float) -> None:
    camera = looking_down(y=0.45 * np.tan(tilt), tilt=-tilt)
    frame, label = DrawnScene(LOW_BOXES).frame(0, camera, PLACES, np.random.default_rng(0))
    above = objects_above_table(frame, AboveTableParameters())
    for number in (1, 2, 3):
        assert np.mean(above.mask[label == number]) > 0.95
    assert np.mean(above.mask[label == 0]) < 0.001


def test_the_plane_and_the_heights_are_those_of_the_world() -> None:
    frame, label = DrawnScene(LOW_BOXES).frame(0, looking_down(tilt=0.1), PLACES, np.random.default_rng(1))
    above = objects_above_table(frame, AboveTableParameters())
    np.testing.assert_allclose(above.plane_W, [0, 0, 1, 0], atol=0.002)
    assert np.median(above.height[label == 0]) == pytest.approx(0.0, abs=0.001)
    assert np.median(above.height[label == 2]) == pytest.approx(0.015, abs=0.001)


def test_the_robot_stands_above_the_table_and_is_none_of_its_objects() -> None:
    robot = np.zeros(CAMERA.shape, bool)
    robot[200:, 100:220] = True
    robot[100:140, 150:170] = True
    scene = DrawnScene(LOW_BOXES)
    frame, label = scene.frame(0, looking_down(), PLACES, np.random.default_rng(2), robot)
    above = objects_above_table(frame, AboveTableParameters())
    assert not above.mask[robot].any()
    assert np.mean(above.mask[label > 0]) > 0.95


@pytest.mark.parametrize("noise", [0.0012, 0.0023, 0.004])
def test_depth_noise_is_read_off_the_table_within_30_percent(noise: float) -> None:
    scene = DrawnScene(LOW_BOXES, depth_noise=noise)
    frame, _ = scene.frame(0, looking_down(tilt=0.1), PLACES, np.random.default_rng(3))
    above = objects_above_table(frame, AboveTableParameters())
    assert above.depth_noise == pytest.approx(noise, rel=0.3)


def test_depth_without_any_noise_is_not_believed_without_end() -> None:
    scene = DrawnScene([], depth_noise=0.0)
    frame, _ = scene.frame(0, looking_down(), [], np.random.default_rng(3))
    flat = replace(frame, depth=np.full_like(frame.depth, 0.45))
    assert objects_above_table(flat, AboveTableParameters()).depth_noise > 0


def test_a_table_that_shows_in_a_third_of_the_image_is_enough() -> None:
    rng = np.random.default_rng(4)
    robot = np.zeros(CAMERA.shape, bool)
    robot[:, 214:] = True
    frame, label = DrawnScene(LOW_BOXES[:2]).frame(0, looking_down(), PLACES[:2], rng, robot)
    frame.depth[:, :70] = 0
    above = objects_above_table(frame, AboveTableParameters())
    measured = (label > 0) & (frame.depth > 0)
    assert np.mean(above.mask[measured]) > 0.95
    assert not above.mask[(label == 0)].any()


def test_a_table_packed_with_things_of_many_heights_is_still_the_table() -> None:
    rng = np.random.default_rng(5)
    cells = [(x, y) for x in np.arange(-0.18, 0.19, 0.06) for y in np.arange(-0.12, 0.13, 0.06)]
    sizes = [(0.048, 0.048, height) for height in np.linspace(0.015, 0.08, len(cells))]
    rng.shuffle(sizes)
    frame, label = DrawnScene(sizes).frame(0, looking_down(), [planar(*c) for c in cells], rng)
    assert np.mean(label == 0) < 0.4
    above = objects_above_table(frame, AboveTableParameters())
    np.testing.assert_allclose(above.plane_W, [0, 0, 1, 0], atol=0.003)
    assert np.mean(above.mask[label > 0]) > 0.95


def test_pixels_without_depth_are_not_above_the_table_and_have_no_height() -> None:
    frame, label = DrawnScene(LOW_BOXES).frame(0, looking_down(), PLACES, np.random.default_rng(6))
    hole = (label == 2) & (np.arange(CAMERA.width) % 40 < 20)
    frame.depth[hole] = 0
    above = objects_above_table(frame, AboveTableParameters())
    assert np.isnan(above.height[hole]).all()
    assert np.isfinite(above.height[~hole]).all()


BLACK, LIT, SHADED = 30, 160, 110


@pytest.mark.parametrize("thing", [BLACK, 230], ids=["black", "white"])
def test_where_depth_is_missing_colour_tells_what_is_the_thing_and_what_the_table_beside_it(thing: int) -> None:
    frame, label = DrawnScene([(0.08, 0.08, 0.04)]).frame(0, looking_down(), [planar(0, 0)])
    v, u = np.nonzero(label)
    left, top, bottom = u.min(), v.min(), v.max()
    # In shadow on its left, where the second imager does not look; bays without depth go from there into it.
    color = np.where(label[..., None] > 0, thing, LIT).astype(np.uint8).repeat(3, -1)
    color[top : bottom + 1, left - 12 : left] = SHADED
    depth = frame.depth.copy()
    depth[top + 4 : bottom - 4 : 12, left - 6 : left + 8] = 0
    depth[top + 5 : bottom - 4 : 12, left - 6 : left + 8] = 0
    depth[top + 6 : bottom - 4 : 12, left - 6 : left + 8] = 0
    above = objects_above_table(replace(frame, color=color, depth=depth), AboveTableParameters())
    np.testing.assert_array_equal(above.mask[depth == 0], label[depth == 0] > 0)


def test_specks_are_no_objects() -> None:
    frame, _ = DrawnScene([]).frame(0, looking_down(), [], np.random.default_rng(7))
    frame.depth[50:52, 60:62] -= 0.03
    assert not objects_above_table(frame, AboveTableParameters()).mask.any()


def test_the_same_frame_gives_the_same_answer() -> None:
    frame, _ = DrawnScene(LOW_BOXES).frame(0, looking_down(), PLACES, np.random.default_rng(8))
    first, second = (objects_above_table(frame, AboveTableParameters()) for _ in range(2))
    np.testing.assert_array_equal(first.mask, second.mask)
    np.testing.assert_array_equal(first.plane_W, second.plane_W)


def test_an_image_without_a_table_is_refused() -> None:
    frame, _ = DrawnScene([]).frame(0, looking_down(), [])
    frame.depth[...] = 0
    with pytest.raises(ValueError, match="no plane"):
        objects_above_table(frame, AboveTableParameters())
    frame.depth[...] = np.random.default_rng(9).uniform(0.3, 3.0, CAMERA.shape)
    with pytest.raises(ValueError, match="no plane"):
        objects_above_table(frame, AboveTableParameters())


ROOMS = {
    "floor and wall far behind": (0.8, 0.08, 1.2),
    "a wall close behind": (0.9, 0.2, 0.26),
    "floor to the side": (0.6, 0.12, 3.0),
}


@pytest.mark.parametrize("where", ROOMS)
def test_a_coloured_table_seen_from_beside_with_the_room_around_it_is_the_table(where: str) -> None:
    tilt, end, wall = ROOMS[where]
    rng = np.random.default_rng(10)
    camera = looking_down(y=-0.5 * np.tan(tilt), z=0.5, tilt=tilt)
    places = [planar(-0.08, 0.0, 0.4), planar(0.03, 0.0), planar(0.06, -0.09, 1.0)]
    scene = DrawnScene(LOW_BOXES, table=Texture(9, contrast=12))
    frame, label = scene.frame(0, camera, places, rng)
    ray_W = rays(CAMERA) @ camera[:3, :3].T
    p_WQ = camera[:3, 3] + ray_W * frame.depth[..., None]
    with np.errstate(divide="ignore"):
        floor = np.where(ray_W[..., 2] < 0, (-0.7 - camera[2, 3]) / ray_W[..., 2], np.inf)
        behind = np.where(ray_W[..., 1] > 0, (wall - camera[1, 3]) / ray_W[..., 1], np.inf)
    beyond = (label == 0) & ((p_WQ[..., 1] > end) | (frame.depth == 0))
    frame.depth[beyond] = np.minimum(floor, behind)[beyond]
    above = objects_above_table(frame, AboveTableParameters())
    np.testing.assert_allclose(above.plane_W, [0, 0, 1, 0], atol=0.01)
    hit = np.count_nonzero(above.mask & (label > 0))
    assert hit / np.count_nonzero(label > 0) >= 0.9
    assert hit / np.count_nonzero(above.mask) >= 0.8


@pytest.mark.renders
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "a fifth"])
def test_objects_in_rooms_as_data_sets_show_them_are_covered_and_little_else(kind: str) -> None:
    hit = standing = marked = 0
    for seed in range(3):
        frame, label, _ = draw_room(KINDS[kind], np.random.default_rng([seed, zlib.crc32(kind.encode())]))
        above = objects_above_table(frame, AboveTableParameters())
        assert above.plane_W[2] > np.cos(np.radians(1.0))
        assert abs(above.plane_W[3]) < 0.02
        hit += np.count_nonzero(above.mask & (label > 0))
        standing += np.count_nonzero(label)
        marked += np.count_nonzero(above.mask)
    assert hit / standing >= 0.9
    assert hit / marked >= 0.8


@pytest.mark.renders
def test_an_object_that_touches_the_wall_is_found_and_the_wall_is_not() -> None:
    room = KINDS["wall, stereo"]
    frame, label, _ = draw_room(room, np.random.default_rng(4))
    above = objects_above_table(frame, AboveTableParameters())
    wall = (label == 0) & (above.height > 0.05)
    assert np.mean(wall) > 0.2
    assert np.mean(above.mask[wall]) < 0.02
    assert np.mean(above.mask[label > 0]) > 0.9


SMALL = Intrinsics(60, 40, 100.0, 100.0, 29.5, 19.5)


def small(depth=0.5, color=90, robot=None):
    """A picture of one depth and colour, or of given ones [40, 60, ...]."""
    shape = SMALL.shape
    pixels = np.broadcast_to(np.asarray(color, np.uint8), (*shape, 3)).copy()
    seen = np.broadcast_to(np.float32(depth), shape).copy()
    return Frame(0, 0.0, SMALL, pixels, seen, np.eye(4), np.zeros(shape, bool) if robot is None else robot)


def test_what_may_stand_there_is_higher_than_its_foot_and_what_surely_does_than_the_noise_of_its_depth() -> (
    None
):
    parameters = AboveTableParameters(height_min=0.004, noise_multiple=4.0, foot_multiple=2.0)
    depth = np.full(SMALL.shape, 0.5)
    depth[:, 30:] = 1.0
    height, robot = np.zeros((2, *SMALL.shape))
    for column, h in ((0, 0.0039), (1, 0.0041), (30, 0.0059), (31, 0.0061), (32, 0.0119), (33, 0.0121)):
        height[:, column] = h
    robot[:10] = 1
    high, clearly = _high(height.astype(np.float32), small(depth, robot=robot > 0), 0.003, parameters)
    # At 1 m 6 and 12 mm; at half a metre a quarter of that, and 4 mm at least.
    assert np.flatnonzero(high[20]).tolist() == [1, 31, 32, 33]
    assert np.flatnonzero(clearly[20]).tolist() == [1, 33]
    assert not high[:10].any()
    # Where all noise is lower than the lowest object, both are one.
    high, clearly = _high(height.astype(np.float32), small(depth), 0.0009, parameters)
    assert np.flatnonzero(high[20]).tolist() == [1, 30, 31, 32, 33]
    assert clearly is None


def without_specks(mask, frame=None, raised=None, clearly=None, area_min=9 / 1e4):
    """Of nine pixels and more, where a square metre has 10,000 at 1 m."""
    raised = mask if raised is None else raised
    return _without_specks(mask, raised, clearly, small() if frame is None else frame, area_min)


def masked(*places):
    mask = np.zeros(SMALL.shape, bool)
    for place in places:
        mask[place] = True
    return mask


def test_pieces_of_less_than_the_least_area_or_of_which_less_rises_clearly_are_none() -> None:
    large, small_ = masked(np.s_[10:13, 10:13]), masked(np.s_[20:22, 30:34])
    np.testing.assert_array_equal(without_specks(large | small_), large)
    np.testing.assert_array_equal(without_specks(large | small_, area_min=8 / 1e4), large | small_)
    wide = masked(np.s_[25:30, 10:20])
    for rows, kept in ((np.s_[25:28, 10:13], True), (np.s_[25:27, 10:14], False)):
        assert without_specks(wide, clearly=masked(rows)).any() == kept
    # By a corner alone pieces do not hang together.
    stairs = masked(np.s_[5:7, 5:9], np.s_[7:9, 9:13])
    assert not _without_specks(stairs, stairs, None, small(), 9 / 1e4)[7, 9]


def test_a_pinhole_is_closed_and_a_hole_that_is_enclosed_without_depth_is_filled_but_not_the_robot() -> None:
    ring = masked(np.s_[10:22, 10:26])
    ring[13:19, 13:23] = False
    np.testing.assert_array_equal(without_specks(ring), ring)  # there is a table in it
    depth = np.full(SMALL.shape, 0.5)
    depth[13:19, 13:23] = 0
    full = masked(np.s_[10:22, 10:26])
    np.testing.assert_array_equal(without_specks(ring, small(depth)), full)
    np.testing.assert_array_equal(without_specks(ring, raised=full), full)
    robot = masked(np.s_[15:17, 15:20])
    np.testing.assert_array_equal(without_specks(ring, small(depth, robot=robot)), full & ~robot)
    pinhole = full.copy()
    pinhole[15, 15] = False
    np.testing.assert_array_equal(without_specks(pinhole), full)


def test_a_hole_is_enclosed_where_it_borders_on_nothing_else_and_not_on_the_pictures_end() -> None:
    around = np.zeros((12, 20), np.uint8)
    around[2:8, 2:8] = 1
    holes = np.zeros((12, 20), bool)
    holes[4:6, 4:6] = True
    assert _enclosed(holes, around & ~holes.view(np.uint8))[4:6, 4:6].all()
    for v, u in ((2, 4), (7, 4), (4, 2), (4, 7)):
        # A way out to each side.
        opened = holes.copy()
        opened[min(v, 4) : max(v, 5) + 1, min(u, 4) : max(u, 5) + 1] = True
        assert not _enclosed(opened, around & ~opened.view(np.uint8)).any()
    for turn in range(4):
        # Of a picture full of things the hole at its side goes on beyond.
        full, at_end = np.ones((2, 12, 12), np.uint8)
        at_end[:] = 0
        at_end[0, 5:7] = 1
        at_end = np.rot90(at_end, turn).copy()
        assert not _enclosed(at_end > 0, full & ~at_end).any()


def test_without_depth_what_has_the_colour_of_the_thing_beside_it_is_its_own() -> None:
    color = np.full((*SMALL.shape, 3), 200)
    color[:, :30] = [160, 40, 40]
    thing, table = masked(np.s_[:, :26]), masked(np.s_[:, 34:])
    places = np.nonzero(~thing & ~table)
    like = np.zeros(SMALL.shape, bool)
    like[places] = _colored_like_things(places, color.astype(np.uint8), thing, table)
    np.testing.assert_array_equal(like[places], (places[1] < 30))
    # With no table about, there is nothing else that it could be; with no thing about, it is none.
    nothing = np.zeros(SMALL.shape, bool)
    assert _colored_like_things(places, color.astype(np.uint8), thing, nothing).all()
    assert not _colored_like_things(places, color.astype(np.uint8), nothing, table).any()


def test_depths_noise_is_the_root_mean_square_of_heights_by_squared_depth() -> None:
    parameters = AboveTableParameters()
    depth = np.full((100, 150), 0.5, np.float32)
    depth[:, 75:] = 1.0
    height = np.where(depth == 0.5, 0.002 * 0.25, -0.004).astype(np.float32)
    on_table = np.ones((20, 30), bool)
    expected = np.sqrt((0.002**2 + 0.004**2) / 2)
    assert _depth_noise(height, depth, on_table, parameters) == pytest.approx(expected)
    few = np.zeros((20, 30), bool)
    few.ravel()[:99] = True
    assert _depth_noise(height, depth, few, parameters) == parameters.plane.depth_noise
    few.ravel()[99] = True
    assert _depth_noise(height, depth, few, parameters) < 0.004
