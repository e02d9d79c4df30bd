"""Of how many freedoms of a motion two things tell: by drawn things, whose freedoms are known."""

import cv2
import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.segmentation.alignment import edge_pixels
from riseg_drake.segmentation.coincidence import freedoms_shown

SHAPE = (240, 320)
CAMERA = Intrinsics(320, 240, 300.0, 300.0, 160.0, 120.0)
LEFT, RIGHT = (110, 120), (210, 120)


def disc(label, gray, number, at):
    cv2.circle(label, at, 49, number, -1)
    cv2.circle(gray, at, 49, 60 + 60 * number, -1, cv2.LINE_AA)


def box(label, gray, number, at):
    corners = np.array(at) + np.array([[-49, -40], [-49, 40], [49, 40], [49, -40]])
    cv2.fillPoly(label, [corners], number)
    cv2.fillPoly(gray, [corners], 60 + 60 * number)


def printed(label, gray, number, at):
    disc(label, gray, number, at)
    rng = np.random.default_rng(number)
    print_ = cv2.GaussianBlur(rng.uniform(0, 255, SHAPE).astype(np.float32), (0, 0), 2)
    gray[label == number] = 4 * print_[label == number] - 380


def bar(label, gray, number, at):
    """As long as the image is high: no end of it is seen."""
    u = at[0]
    label[:, u - 49 : u + 49] = number
    gray[:, u - 49 : u + 49] = 60 + 60 * number


def shown(left, right, turned=0.0):
    """Of how many freedoms two things beside each other tell, in an image that is turned by an angle, rad."""
    label, gray = np.zeros(SHAPE, np.uint8), np.full(SHAPE, 20, np.float32)
    left(label, gray, 1, LEFT)
    right(label, gray, 2, RIGHT)
    if turned:
        turn = cv2.getRotationMatrix2D((160, 120), np.rad2deg(turned), 1.0)
        label = cv2.warpAffine(label, turn, SHAPE[::-1], flags=cv2.INTER_NEAREST)
        gray = cv2.warpAffine(gray, turn, SHAPE[::-1], borderValue=20)
    gray = cv2.GaussianBlur(np.clip(gray, 0, 255), (0, 0), 1.0)
    image = np.repeat(np.round(gray).astype(np.uint8)[..., None], 3, axis=2)
    none = np.zeros(SHAPE, bool)
    frame = Frame(0, 0.0, CAMERA, image, np.full(SHAPE, 0.6, np.float32), np.eye(4), none)
    piece = label.astype(np.intp) - 1
    edges = edge_pixels(frame, piece, frame.gradient_squared > 4, np.full(SHAPE, 4, np.float32), 6000)
    borders = np.array([[0, 1], [1, 0], [0, 0]])
    told = freedoms_shown(edges, frame.gray, np.array([0, 1]), borders)
    assert told[0] == told[1]
    assert told[2] == 3.0
    return float(told[0])


def test_two_blank_discs_have_one_freedom_in_common_their_distance():
    assert shown(disc, disc) == pytest.approx(1.0, abs=0.25)


@pytest.mark.parametrize("thing", [printed, box])
def test_a_blank_disc_has_two_in_common_with_what_shows_how_it_is_turned(thing):
    assert shown(thing, disc) == pytest.approx(2.0, abs=0.25)


def test_things_that_show_how_they_are_turned_have_three_in_common():
    assert shown(printed, printed) == pytest.approx(3.0, abs=0.2)
    assert shown(box, box) == pytest.approx(3.0, abs=0.3)


def test_what_has_no_ends_tells_nothing_of_going_along_itself():
    assert shown(bar, printed) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("pair", [(disc, disc), (disc, printed), (box, disc)])
def test_an_image_that_is_turned_tells_as_much(pair):
    assert shown(*pair, turned=0.6) == pytest.approx(shown(*pair), abs=0.2)
