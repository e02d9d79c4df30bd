"""The camera alone, fed with images that are known: when it looks, what it keeps, what it measures."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.sensors import ImageDepth32F, ImageLabel16I, ImageRgba8U

from riseg_drake.stations.sensor_noise import SensorNoise
from riseg_drake.stations.wrist_camera import (
    CameraConfig,
    ObjectLabels,
    WristCamera,
    check_camera,
    measured_images,
)

SIZE = (32, 24)
NONE = SensorNoise(enabled=False)


def config(**changed):
    width, height = SIZE
    given = {"width": width, "height": height, "fx": 40.0, "fy": 41.0, "cx": 15.5, "cy": 11.5, "noise": NONE}
    return CameraConfig(**{**given, **changed})


def color_of(value):
    image = ImageRgba8U(*SIZE)
    image.mutable_data[:] = value
    return image


def depth_of(value):
    image = ImageDepth32F(*SIZE)
    image.mutable_data[:] = value
    return image


class Taken:
    """A camera of 10 pictures a second, each 30 ms late."""

    def __init__(self, settings=None, seed=0):
        self.camera = WristCamera(settings or config(), seed, 0.1, 0.03)
        self.simulator = Simulator(self.camera)
        self.context = self.simulator.get_mutable_context()
        self.show(50, 1.0)
        self.camera.GetInputPort("camera_pose").FixValue(self.context, Value(RigidTransform()))

    def show(self, color, depth):
        self.camera.GetInputPort("color_image").FixValue(self.context, Value(color_of(color)))
        self.camera.GetInputPort("depth_image").FixValue(self.context, Value(depth_of(depth)))

    def seen(self):
        color, depth = (
            self.camera.GetOutputPort(name).Eval(self.context).data for name in ("color_image", "depth_image")
        )
        return float(self.camera.GetOutputPort("image_time").Eval(self.context)[0]), color, depth


def test_before_the_first_picture_there_is_none():
    time, color, _ = Taken().seen()
    assert time == -1
    assert color.size == 0


def test_pictures_are_taken_at_the_start_and_after_every_period_by_the_delay_late_and_held():
    taken = Taken()
    taken.simulator.Initialize()
    expected = [(0.0, 50), (0.0, 50), (0.13, 60), (0.13, 60), (0.23, 70)]
    for (at, gray), time in zip(expected, (0.0, 0.12, 0.14, 0.22, 0.24), strict=True):
        taken.show(50 + 10 * round(max(0.0, time - 0.04) / 0.1), 1.0)
        taken.simulator.AdvanceTo(time)
        stamp, color, depth = taken.seen()
        assert stamp == pytest.approx(at)
        assert (color[..., :3] == gray).all()
        assert color.shape == (24, 32, 4)
        assert (depth == 1.0).all()


def test_the_noise_depends_on_the_number_of_the_picture_and_the_seed_alone():
    def pictures(seed):
        taken = Taken(config(noise=SensorNoise()), seed)
        taken.simulator.Initialize()
        first = taken.seen()[2].copy()
        taken.simulator.AdvanceTo(0.15)
        return first, taken.seen()[2].copy()

    (one, two), (again, _), (other, _) = pictures(3), pictures(3), pictures(4)
    np.testing.assert_array_equal(one, again)
    assert not np.array_equal(one, two)
    assert not np.array_equal(one, other)


def test_depth_is_measured_between_its_least_and_its_most():
    depth = np.full(SIZE[::-1], 1.0, np.float32)
    depth[0, :7] = [0.29, 0.31, 2.99, 3.01, 0.0, np.inf, np.nan]
    color = np.full((*SIZE[::-1], 3), 90, np.uint8)
    seen, measured = measured_images(color, depth, config(), np.random.default_rng(0), np.eye(4), 0)
    np.testing.assert_allclose(measured[0, :7], [0, 0.31, 2.99, 0, 0, 0, 0], rtol=1e-5)
    np.testing.assert_array_equal(seen, color)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"cx": 32.0}, "cx is 32; expected a pixel of the picture, 0 to 31"),
        ({"cx": -0.1}, "cx is -0.1"),
        ({"cy": 24.0}, "cy is 24; expected a pixel of the picture, 0 to 23"),
        ({"depth_max": 0.3}, "depth_min is 0.3; less than depth_max, 0.3 m"),
    ],
)
def test_a_camera_that_cannot_be_is_said_to_be_none(changed, said):
    right = {"cx": 0.0, "cy": 23.9, "width": 32, "height": 24, "depth_min": 0.3, "depth_max": 3.0}
    check_camera(**right)
    with pytest.raises(ValueError, match=said):
        check_camera(**{**right, **changed})


def test_labels_become_ids_by_the_table():
    table = np.zeros(2**15, np.int16)
    table[[5, 9, 32767]] = [1, 2, 3]
    labels = ObjectLabels(config(), table)
    context = labels.CreateDefaultContext()
    image = ImageLabel16I(*SIZE)
    image.mutable_data[0, :4, 0] = [9, 5, 4, 32767]
    labels.get_input_port().FixValue(context, Value(image))
    ids = labels.get_output_port().Eval(context).data[..., 0]
    assert ids[0, :5].tolist() == [2, 1, 0, 3, 0]
