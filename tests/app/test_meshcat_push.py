import numpy as np
import pytest
from pydrake.geometry import Meshcat

from riseg_drake.app import meshcat_push
from riseg_drake.app.meshcat_push import draw_push
from riseg_drake.pushing.push import Push
from tests.pushing.bar import BAR


def push(**others):
    """Five centimetres forward on the table, towards (0.6, 0.8)."""
    return Push(
        **{
            "p_WE": np.array([0.5, 0.1, 0.01]),
            "tip_height": 0.008,
            "direction_W": np.array([0.6, 0.8]),
            "p_WB": np.array([0.518, 0.124, 0.01]),
            "length": 0.05,
            "d_push": 0.03,
            "center_W": np.zeros(2),
            "cluster_W": np.zeros((0, 2)),
            "tallest": 0.03,
            "cost": 0.0,
            **others,
        }
    )


class Paper:
    """As much of Meshcat as is used, to be read."""

    def __init__(self):
        self.shapes, self.poses = {}, {}

    def SetObject(self, path, shape, color):
        self.shapes[path] = shape

    def SetTransform(self, path, X):
        self.poses[path] = X


def test_a_push_is_drawn_as_arrow_and_swept_area():
    meshcat = Meshcat()
    draw_push(meshcat, "/push", push(), BAR)
    for part in ("arrow/shaft", "arrow/head", "swept"):
        assert meshcat.HasPath(f"/push/{part}")


def test_the_arrow_ends_where_the_contact_will_be():
    paper = Paper()
    draw_push(paper, "/push", push(), BAR)
    # The cone's point is its origin.
    expected = [0.518 + 0.03 * 0.6, 0.124 + 0.03 * 0.8, 0.01 + meshcat_push.ARROW_LIFT]
    assert paper.poses["/push/arrow/head"].translation() == pytest.approx(expected)


def test_the_swept_area_reaches_from_the_bars_back_at_first_to_its_face_at_last():
    paper = Paper()
    draw_push(paper, "/push", push(), BAR)
    box, X_WS = paper.shapes["/push/swept"], paper.poses["/push/swept"]
    assert box.size()[:2] == pytest.approx([0.07, 0.03])
    ends = [X_WS.multiply(np.array([sign * 0.035, 0.0, 0.0])) for sign in (-1, 1)]
    ahead = np.array([0.6, 0.8])
    assert ends[0][:2] == pytest.approx([0.5, 0.1] - 0.01 * ahead)
    assert ends[1][:2] == pytest.approx([0.5, 0.1] + 0.06 * ahead)
    # On the table, which is as far below the tip as the push says.
    assert 0.002 < ends[0][2] < 0.004
