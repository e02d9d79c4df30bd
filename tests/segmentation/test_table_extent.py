"""Where a table ends, from straight above, where every pixel can be worked out by hand."""

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, back_project
from riseg_drake.geometry.plane import heights_above_plane
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.table_extent import (
    TableExtentParameters,
    _axes,
    _broad,
    _ends,
    _feet,
    _going_on,
    _largest,
    _share,
    _Table,
    on_this_table,
)

CAMERA = Intrinsics(320, 240, 200.0, 200.0, 159.5, 119.5)
ABOVE = 1.0
"""m, of the camera over the table: a pixel is 5 mm there."""
FLOOR = -0.7
TABLE_C = np.array([0.0, 0.0, -1.0, ABOVE])
HEIGHT_MIN = 0.004


def frame_of(height: np.ndarray) -> Frame:
    """What a camera straight above sees of heights [H, W], m, drawn pixel by pixel; NaN has no depth."""
    depth = np.nan_to_num(ABOVE - height).astype(np.float32)
    color = np.zeros((*CAMERA.shape, 3), np.uint8)
    return Frame(0, 0.0, CAMERA, color, depth, np.eye(4), np.zeros(CAMERA.shape, bool))


def table(rows: slice = slice(40, 200), columns: slice = slice(60, 260)) -> np.ndarray:
    """A table 1 m x 0.8 m amid the floor, if nothing else is said."""
    height = np.full(CAMERA.shape, FLOOR)
    height[rows, columns] = 0
    return height


def held(height: np.ndarray, **parameters: float) -> np.ndarray | None:
    frame = frame_of(height)
    seen = heights_above_plane(frame.depth, CAMERA, TABLE_C)
    on_table = np.abs(seen[::5, ::5]) < HEIGHT_MIN
    return on_this_table(frame, seen, TABLE_C, on_table, HEIGHT_MIN, TableExtentParameters(**parameters))


def share_of(mask: np.ndarray, rows: slice, columns: slice) -> float:
    return float(mask[rows, columns].mean())


def test_where_the_image_shows_nothing_but_the_table_it_has_no_end() -> None:
    height = np.zeros(CAMERA.shape)
    height[100:140, 100:140] = 0.1
    assert held(height) is None


@pytest.mark.parametrize(("rows", "ends"), [(220, False), (240, True)])
def test_less_than_three_hundredths_of_the_room_do_not_matter(rows: int, ends: bool) -> None:
    # Of every tenth pixel, 768 in all, 22 or 24 see the floor: 2.9 or 3.1 %.
    height = np.zeros(CAMERA.shape)
    height[:rows, :10] = FLOOR
    assert (held(height) is not None) is ends


def test_what_stands_on_the_table_is_kept_and_what_stands_on_the_floor_is_not() -> None:
    height = table()
    thing, chair = (slice(100, 130), slice(150, 190)), (slice(90, 150), slice(275, 315))
    height[thing], height[chair] = 0.08, 0.1
    mask = held(height)
    assert mask is not None
    assert share_of(mask, *thing) == 1.0
    assert share_of(mask, *chair) == 0.0


@pytest.mark.parametrize(("columns", "kept"), [(slice(250, 274), True), (slice(257, 281), False)])
def test_a_thing_over_the_edge_is_the_tables_from_a_third_of_it_on_or_where_it_lies_well_inside(
    columns: slice, kept: bool
) -> None:
    # The table's last column is 259: 10 of 24 pixels, and 2 more of the margin, are on it; or 3 and 2.
    height = table()
    height[100:130, columns] = 0.05
    mask = held(height)
    assert mask is not None
    assert share_of(mask, slice(100, 130), slice(columns.start + 5, columns.stop)) == float(kept)


def test_what_goes_on_below_the_table_stands_on_the_floor() -> None:
    # A shelf that leans on the table's edge: half of it above the plane and half below, without a step between.
    height = table(columns=slice(60, 200))
    height[80:160, 200:230] = np.linspace(0.15, -0.15, 30)
    height[80:160, 195:200] = 0.15
    mask = held(height)
    assert mask is not None
    assert share_of(mask, slice(80, 160), slice(206, 230)) == 0.0  # before it, well inside


@pytest.mark.parametrize(("high", "kept"), [(0.44, 1.0), (0.46, 0.0)])
def test_what_is_taller_than_things_are_is_none(high: float, kept: float) -> None:
    height = table()
    height[100:130, 150:190] = high
    mask = held(height)
    assert mask is not None
    assert share_of(mask, slice(100, 130), slice(150, 190)) == kept


def test_too_little_of_a_table_says_nothing_of_its_end() -> None:
    assert held(table(slice(100, 130), slice(100, 130))) is None


@pytest.mark.parametrize("normal", [[0.0, 0.0, -1.0], [0.6, 0.0, -0.8], [0.2, -0.9, 0.1]])
def test_feet_are_the_points_without_their_heights(normal: list[float]) -> None:
    n = np.array(normal) / np.linalg.norm(normal)
    along = _axes(n)
    np.testing.assert_allclose(along @ along.T, np.eye(2), atol=1e-12)
    np.testing.assert_allclose(along @ n, 0, atol=1e-12)
    frame = frame_of(np.random.default_rng(0).uniform(0, 0.3, CAMERA.shape))
    p_CQ = back_project(frame.depth, CAMERA)[::7, ::7]
    np.testing.assert_allclose(_feet(frame, along, 7), p_CQ @ along.T, atol=1e-5)


def test_a_strip_of_table_along_a_wall_is_not_broad_unless_the_table_is_full() -> None:
    on_table = np.zeros((20, 20), bool)
    on_table[4:16, 4:16] = True
    on_table[10, 16:] = True  # two pixels high at most
    broad = _broad(on_table)
    assert broad[4:16, 4:16].all()
    assert not broad[:, 16:].any()
    gaps = np.zeros((20, 20), bool)
    gaps[::4] = True
    np.testing.assert_array_equal(_broad(gaps), gaps)


@pytest.mark.parametrize(("gap", "parts"), [(0.16, 2), (0.06, 1)])
def test_what_hides_the_table_parts_it_no_farther_than_the_gap(gap: float, parts: int) -> None:
    # Two parts of 40 x 30 and 40 x 20 cm, `gap` apart; 8 cm part nothing: one cell of 4 cm on each side.
    u, v = np.meshgrid(np.arange(0, 0.5 + gap, 0.01), np.arange(0, 0.4, 0.01))
    feet = np.stack([u, v], axis=-1).astype(np.float32)
    wide = (u < 0.3) | (u >= 0.3 + gap)
    largest = _largest(wide, feet, gap=0.08)
    np.testing.assert_array_equal(largest, wide if parts == 1 else u < 0.3)


def test_the_ends_of_a_row_are_its_first_and_last_pixel() -> None:
    top = np.array([[0, 1, 1, 0, 1], [0, 0, 0, 0, 0], [0, 0, 1, 0, 0]], bool)
    np.testing.assert_array_equal(_ends(top), [[0, 1, 0, 0, 1], [0, 0, 0, 0, 0], [0, 0, 1, 0, 0]])


def test_beyond_the_images_border_the_table_goes_on_outwards_from_its_middle() -> None:
    u, v = np.meshgrid(np.arange(-2.0, 3.0), np.arange(-1.0, 2.0))
    feet = np.stack([u, v], axis=-1).astype(np.float32)
    top = np.zeros((3, 5), bool)
    top[1] = True  # a strip across the image
    np.testing.assert_allclose(_going_on(top, feet, 0.2), [[-2.2, 0], [2.2, 0]], atol=1e-6)


def test_a_table_holds_its_hull_and_a_margin_outside_or_less_than_all_of_it() -> None:
    square = _Table(np.array([[0, 0], [0.4, 0], [0, 0.4], [0.4, 0.4], [0.2, 0.2]], np.float32))
    at = np.array(
        [[[0.2, 0.2], [0.2, 0.05], [0.2, -0.015], [0.2, -0.05], [-0.015, 0.2], [0.5, 0.5]]], np.float32
    )
    np.testing.assert_array_equal(square.holds(at, 0.02), [[True, True, True, False, True, False]])
    np.testing.assert_array_equal(square.holds(at, -0.1), [[True, False, False, False, False, False]])


def test_a_share_is_of_each_labels_own_pixels() -> None:
    label = np.array([[0, 0, 1, 1], [0, 0, 1, 2]], np.int32)
    what = np.array([[0, 1, 1, 1], [0, 0, 0, 0]], bool)
    np.testing.assert_allclose(_share(what, label, 4), [1 / 4, 2 / 3, 0, 0])


@pytest.mark.parametrize(("apart", "parts"), [(0.14, 1), (0.28, 2)])
def test_what_hides_the_table_by_a_hand_s_breadth_parts_it_not(apart: float, parts: int) -> None:
    u, v = np.meshgrid(np.arange(0, 0.5 + apart, 0.01), np.arange(0, 0.4, 0.01))
    feet = np.stack([u, v], axis=-1).astype(np.float32)
    wide = (u < 0.3) | (u >= 0.3 + apart)
    largest = _largest(wide, feet, TableExtentParameters().gap)
    np.testing.assert_array_equal(largest, wide if parts == 1 else u < 0.3)


@pytest.mark.parametrize(
    ("high", "parameters", "elsewhere"),
    [(0.045, {}, False), (0.005, {}, True), (0.045, {"far": 0.01}, True), (0.005, {"far": 0.06}, False)],
)
def test_what_stands_farther_than_3_cm_beside_the_seen_table_is_elsewhere(high, parameters, elsewhere):
    # Nothing is seen but the table, from its column 60 to 255, and what hides the floor beside it: of every
    # tenth pixel 32 of 768, where 24 are enough. Higher up a pixel is smaller, and so nearer to the middle:
    # of these, columns 50 and 260, feet are 2.5 and 2.7 cm from the table's, or 4.7; its map has cells of 1 cm.
    height = np.full(CAMERA.shape, np.nan)
    height[40:200, 60:256] = 0.0
    height[40:200, 46:56] = height[40:200, 256:266] = high
    assert (held(height, **parameters) is not None) is elsewhere
