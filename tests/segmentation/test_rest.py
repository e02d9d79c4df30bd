from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.segmentation.noise import MeasurementNoise
from riseg_drake.segmentation.rest import RestParameters, is_still
from tests.segmentation.drawn_scene import DrawnScene, looking_down, planar, standing

SCENE = DrawnScene([(0.08, 0.07, 0.03)])
OVER = looking_down()


def shown(X_WC=OVER, x: float = 0.0, seed: int = 0):
    frame, label = SCENE.frame(seed, X_WC, [planar(x, 0.0)], np.random.default_rng(seed))
    return frame, standing(frame, label > 0)


def still(a, b) -> bool:
    return is_still(a[0], b[0], b[1], MeasurementNoise(), RestParameters())


def test_noise_alone_is_no_motion():
    assert still(shown(seed=1), shown(seed=2))


def test_a_body_that_goes_on_by_a_millimetre_is_not_at_rest():
    assert not still(shown(seed=1), shown(x=0.001, seed=2))


def test_nor_is_a_camera_that_moves_by_more_than_a_pixel():
    # 308 pixels of focal length, 0.45 m away: a millimetre is 0.7 pixels.
    assert still(shown(seed=1), shown(looking_down(0.0005), seed=2))
    assert not still(shown(seed=1), shown(looking_down(0.003), seed=2))


def test_what_the_robot_hides_is_not_looked_at():
    frame, above = shown(x=0.001, seed=2)
    assert still(shown(seed=1), (replace(frame, robot=above.mask), above))


@pytest.mark.parametrize("value", [True, False])
def test_where_nothing_stands_only_the_camera_can_move(value):
    frame, above = shown(seed=2)
    nothing = standing(frame, np.zeros_like(above.mask))
    moved = frame if value else replace(frame, X_WC=looking_down(0.01))
    assert is_still(shown(seed=1)[0], moved, nothing, MeasurementNoise(), RestParameters()) is value
