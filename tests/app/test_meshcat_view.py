from dataclasses import replace

import numpy as np
import pytest
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from riseg_drake.app.meshcat_stage import (
    BOARD,
    BOARD_SIZE,
    EYE,
    FIELD_OF_VIEW,
    PANEL,
    PANEL_WIDTH,
    TARGET,
    facing,
    on_stage,
)
from riseg_drake.app.meshcat_view import (
    GAMMA,
    MeshcatView,
    Stage,
    caption_of,
    ending_of,
    label_texts,
    panel_picture,
    points_of,
)
from riseg_drake.geometry.camera import Intrinsics, back_project
from riseg_drake.geometry.rgbd import Frame, FramePair
from riseg_drake.pictures.cards import board, set_card, with_caption
from riseg_drake.pictures.object_colors import object_colors
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.segmentation.partition import Margins
from riseg_drake.segmentation.segmentation import Segmentation
from tests.browser import NARROW, WIDE

INTRINSICS = Intrinsics(30, 30, 30.0, 30.0, 15.0, 15.0)


def frame():
    """A camera 1 m above the table, looking straight down at a plane 0.5 m away."""
    X_WC = np.diag([1.0, -1.0, -1.0, 1.0])
    X_WC[:3, 3] = [0.3, 0.0, 1.0]
    robot = np.zeros((30, 30), bool)
    robot[27:] = True
    depth = np.full((30, 30), 0.5, np.float32)
    depth[:3] = 0
    return Frame(0, 0.0, INTRINSICS, np.full((30, 30, 3), 90, np.uint8), depth, X_WC, robot)


def mask_of(object_id):
    mask = np.zeros((30, 30), np.uint16)
    mask[15, 15] = object_id
    return mask


def test_points_lie_in_the_world_tinted_in_the_colours_of_their_objects():
    points = points_of(frame(), mask_of(4))
    # All of so few, less three rows without depth and three on the robot.
    assert len(points.ids) == 30 * 24
    np.testing.assert_allclose(points.p_WQ[:, 2], 0.5, atol=1e-6)
    (middle,) = np.flatnonzero(np.linalg.norm(points.p_WQ - [0.3, 0, 0.5], axis=1) < 1e-6)
    assert points.ids[middle] == 4
    np.testing.assert_allclose(points.colors[middle], 0.7 * object_colors(np.array(4)) + 0.3 * 90, atol=1)
    assert (np.delete(points.colors, middle, axis=0) == 90).all()


def test_of_many_pixels_every_third_is_where_it_would_be_among_all():
    rows, columns = np.mgrid[:480, :640]
    camera = Intrinsics(640, 480, 600.0, 610.0, 310.0, 250.0)
    depth = (0.5 + 1e-4 * columns + 2e-4 * rows).astype(np.float32)
    color = np.zeros((480, 640, 3), np.uint8)
    seen = Frame(0, 0.0, camera, color, depth, np.eye(4), np.zeros((480, 640), bool))
    points = points_of(seen, np.zeros((480, 640), np.uint16))
    every = back_project(depth, camera)[::3, ::3].reshape(-1, 3)
    np.testing.assert_allclose(points.p_WQ, every, atol=1e-6)


def test_a_caption_that_is_too_long_is_made_to_fit():
    text = "interaction 12, approach: 100 objects found"
    picture = with_caption(np.zeros((30, 320, 3), np.uint8), text)
    inked = np.flatnonzero(picture[30:].max(axis=(0, 2)) > 128)
    assert inked.min() > 0
    assert inked.max() < 320 - 8


def test_a_cloud_lifts_objects_only_and_has_linear_colours():
    points = points_of(frame(), mask_of(4))
    cloud = points.cloud(0.01)
    np.testing.assert_allclose(cloud.xyzs()[2], np.where(points.ids > 0, 0.51, 0.5), atol=1e-6)
    np.testing.assert_allclose(cloud.rgbs()[:, 0] / 255, (90 / 255) ** GAMMA, atol=1 / 255)
    assert points.of_objects.cloud(0.01).size() == 1


def test_a_label_stands_over_the_middle_of_its_object():
    tops = points_of(frame(), mask_of(4)).tops()
    assert list(tops) == [4]
    np.testing.assert_allclose(tops[4], [0.3, 0.0, 0.5], atol=1e-6)


def test_a_label_says_how_sure_its_object_is_and_whether_that_is_too_little():
    # By definition half sure at half the margin that settles.
    segmentation = Segmentation(0, mask_of(1), Margins({1: 1.0, 2: 2.0}, {1: 9.0, 2: 9.0}), settled=2.0)
    assert label_texts(segmentation) == {1: "1  50 %  in doubt", 2: "2  88 %"}


def test_what_no_rest_has_decided_on_has_a_label_that_says_so():
    segmentation = Segmentation(0, mask_of(5), Margins({1: 1.0}, {1: 9.0}), settled=2.0)
    assert label_texts(segmentation) == {1: "1  50 %  in doubt", 5: "5  not decided"}


def test_a_view_without_objects_has_no_list():
    meshcat = Meshcat()
    panels([(90, 0), (150, 0)], meshcat)
    assert not meshcat.HasPath("/riseg/board")


def test_the_caption_counts_in_words():
    segmentation = Segmentation(0, mask_of(4))
    assert caption_of(2, ArmPhase.PUSH, segmentation) == "interaction 2, push: 1 object found"


def test_the_panel_has_the_cameras_picture_above_a_line_of_text():
    wide = np.zeros((480, 640, 3), np.uint8)
    seen = Frame(
        0, 0.0, INTRINSICS, wide, np.ones((480, 640), np.float32), np.eye(4), np.zeros((480, 640), bool)
    )
    picture = panel_picture(seen, Segmentation(0, np.zeros((480, 640), np.uint16)), "a caption")
    assert picture.shape == (300 + 50, 400, 3)
    assert (picture[:300] == 0).all()
    assert picture[300:].max() > 200


def panels(frames, meshcat):
    """How many pictures were shown once these were seen, by their gray level and the object's id: a tick each;
    the view, and the context of the diagram around it."""
    view = MeshcatView(meshcat, 0.5, Stage((0.5, 0.0), tool=None))
    builder = DiagramBuilder()
    builder.AddSystem(view)
    for name in ("pair", "segmentation", "active_push", "interaction_step", "phase"):
        builder.ExportInput(view.GetInputPort(name), name)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    for name, value in (("active_push", NO_PUSH), ("interaction_step", 2), ("phase", ArmPhase.OBSERVE)):
        diagram.GetInputPort(name).FixValue(context, value)
    for tick, (gray, object_id) in enumerate(frames):
        seen = replace(frame(), sequence=tick, color=np.full((30, 30, 3), gray, np.uint8))
        diagram.GetInputPort("pair").FixValue(context, FramePair(seen, seen))
        margins = Margins({object_id: 1.0}, {object_id: 9.0}) if object_id else Margins()
        found = Segmentation(tick, mask_of(object_id), margins)
        diagram.GetInputPort("segmentation").FixValue(context, found)
        simulator.AdvanceTo(0.5 * tick + 0.1)
    number = 0
    while meshcat.HasPath(f"/riseg/panel/{number + 1}"):
        number += 1
    return number, view, context


@pytest.mark.parametrize(
    ("frames", "shown"),
    [
        ([(90, 4)], 1),
        ([(90, 4), (92, 4), (90, 4)], 1),  # noise, and nothing else
        ([(90, 4), (120, 4), (120, 4)], 2),
        ([(90, 4), (90, 5)], 2),
        ([(90, 4), (96, 4), (102, 4)], 2),  # a little at a time is as much in the end
    ],
)
def test_a_picture_is_shown_anew_only_where_a_person_would_see_a_difference(frames, shown):
    assert panels(frames, Meshcat())[0] == shown


class Watched:
    """A Meshcat that remembers what is where, m, and what is shown."""

    def __init__(self):
        self.meshcat, self.p_W, self.shown = Meshcat(), {}, set()

    def SetTransform(self, path, X, *time):
        self.p_W[path] = X.translation()
        self.meshcat.SetTransform(path, X, *time)

    def SetProperty(self, path, name, value, *time):
        if name == "visible":
            (self.shown.add if value else self.shown.discard)(path)
        self.meshcat.SetProperty(path, name, value, *time)

    def __getattr__(self, name):
        return getattr(self.meshcat, name)


def test_a_new_picture_stands_a_little_before_the_last_and_the_two_before_it_stay():
    watched = Watched()
    assert panels([(90, 4), (150, 4), (210, 4), (30, 4), (90, 4)], watched)[0] == 5
    places = np.array([watched.p_W[f"/riseg/panel/{number}"] for number in range(1, 6)])
    towards_the_eye = on_stage((0.5, 0.0), EYE) - places[0]
    towards_the_eye /= np.linalg.norm(towards_the_eye)
    np.testing.assert_allclose(np.diff(places, axis=0), 4 * [5e-5 * towards_the_eye], atol=1e-9)
    assert {path for path in watched.shown if "panel" in path} == {f"/riseg/panel/{k}" for k in (3, 4, 5)}


def test_the_end_is_shown_whatever_was_shown_before():
    meshcat = Meshcat()
    number, view, context = panels([(90, 4)], meshcat)
    view.show_end(context)
    assert number == 1
    assert meshcat.HasPath("/riseg/panel/2")
    assert ending_of(2, Segmentation(0, mask_of(4))) == "ended after 2 interactions: 1 object found"


def test_a_card_faces_who_looks_from_the_front_and_stands_upright():
    X_WK = facing(on_stage([0.5, 0.1], PANEL))
    R = X_WK.rotation().matrix()
    np.testing.assert_allclose(R[:, 1], (TARGET - EYE) / np.linalg.norm(TARGET - EYE), atol=1e-12)
    assert R[2, 0] == pytest.approx(0.0)
    assert R[2, 2] > 0
    np.testing.assert_allclose(X_WK.translation(), np.array([0.5, 0.1, 0.0]) + PANEL)


def test_a_card_is_an_object_of_the_scene():
    meshcat = Meshcat()
    set_card(meshcat, "/card", np.zeros((3, 4, 3), np.uint8), 0.2)
    assert meshcat.HasPath("/card")


def corners(middle, width, height):
    """Of a card at a place on the stage, as points [4, 3] from its middle's, m."""
    R = facing(middle).rotation().matrix()
    across, up = R[:, 0] * width / 2, R[:, 2] * height / 2
    return middle + np.array([a * across + b * up for a in (-1, 1) for b in (-1, 1)])


def in_window(points, size):
    """Whether points [N, 3] of the stage are seen in a window of a size, pixels, by pinhole projection."""
    R = facing(EYE).rotation().matrix()
    right, ahead, up = ((points - EYE) @ R).T
    half = np.tan(np.radians(FIELD_OF_VIEW / 2))
    return (np.abs(up / ahead) < half) & (np.abs(right / ahead) < half * size[0] / size[1])


def test_a_wide_window_shows_picture_and_list_and_a_narrow_one_the_picture_alone():
    picture = corners(PANEL, PANEL_WIDTH, PANEL_WIDTH * 350 / 400)
    of_list = corners(BOARD, *BOARD_SIZE)
    for size in (WIDE, NARROW):
        assert in_window(picture, size).all()
    assert in_window(of_list, WIDE).all()
    assert not in_window(of_list, NARROW).any()
    # They do not cover each other: from the left, the picture ends before the list begins.
    right = facing(EYE).rotation().matrix()[:, 0]
    assert (picture @ right).max() + 0.01 < (of_list @ right).min()


@pytest.mark.parametrize("count", [1, 6, 7, 25])
def test_a_list_has_a_field_for_each_object_in_its_colour_from_above_and_all_fit(count):
    card = board("some found", {a: f"{a}  50 %  in doubt" for a in range(1, count + 1)}, (720, 480))
    assert card.shape == (720, 480, 3)
    line = 720 / max(8, count + 2)
    middles = np.rint((np.arange(count) + 2) * line).astype(int)
    colors = np.array([object_colors(np.array(a)) for a in range(1, count + 1)])
    np.testing.assert_array_equal(card[middles, round(0.9 * line)], colors)
    empty = card[0, 0]
    assert (card[-round(line / 2) :] == empty).all()
    assert (card[:, -round(line / 4) :] == empty).all()


def test_the_list_is_drawn_once_for_the_same_words():
    meshcat = Meshcat()
    panels([(90, 4), (150, 4), (210, 5), (30, 4)], meshcat)
    assert meshcat.HasPath("/riseg/board/2")
    assert not meshcat.HasPath("/riseg/board/3")
