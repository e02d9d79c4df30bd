import numpy as np
import pytest
from drake import lcmt_image_array
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator

from riseg_drake.robot.kinematics import READY
from riseg_drake.stations.contract import STATION_INPUTS, STATION_OUTPUTS, check_contract
from riseg_drake.stations.even_clock import EvenClock
from riseg_drake.stations.hardware import HardwareStation, HardwareStationConfig
from riseg_drake.stations.ideal_arm import status_message
from riseg_drake.stations.lcm_images import ImageError, encode_images
from riseg_drake.stations.lcm_reception import BLIND, Reception
from tests.stations.mutated_messages import picture_message

START = 1_790_000_000.0
"""A wall time."""


class Bench:
    """A station on an LCM network of this process, with a clock that is turned by hand."""

    def __init__(self, config=None, replayed=False):
        self.config = config or HardwareStationConfig()
        self.lcm = DrakeLcm("memq://")
        self.now, self.replayed = START, replayed
        self.sent = []
        self.set_by = 0.0  # somebody has set the computer's clock
        clock = EvenClock(lambda: self.now + self.set_by, lambda: self.now - START)
        self.reception = Reception(self.lcm, self.config.lcm, replayed, clock)
        self.station = HardwareStation(self.config, self.reception, self)
        self.simulator = Simulator(self.station)
        self.context = self.simulator.get_mutable_context()
        self.context.SetTime(START)
        self.station.GetInputPort("panda.position").FixValue(self.context, READY)
        self.simulator.Initialize()

    def send_target(self, time, position):
        self.sent.append((time, np.array(position)))

    def done_until(self):
        return self.now

    def status(self, time, position):
        self.now = self.now if self.replayed else max(self.now, time)
        message = status_message(time + self.set_by, position)
        self.lcm.Publish(self.config.lcm.status_channel, message.encode())
        self.reception.listen()

    def picture(self, time, gray=100, depth=0.5, aligned=True):
        self.now = self.now if self.replayed else max(self.now, time + 0.03)
        color = np.full((480, 848, 3), gray, np.uint8)
        metres = np.full((480, 848), depth, np.float32)
        message = encode_images(
            color,
            metres if aligned else None,
            time + self.set_by,
            time + self.set_by + 0.03,
            0,
            raw_depth=None if aligned else metres,
        )
        self.lcm.Publish(self.config.lcm.image_channel, message.encode())
        self.reception.listen()

    def moving_arm(self, until):
        """A status every 10 ms of an arm whose joints turn by 1 rad/s from READY."""
        for time in np.arange(START, until, 0.01):
            self.status(time, READY + (time - START))

    def advance(self, to):
        for now in [*np.arange(self.context.get_time() + 0.02, to, 0.02), to]:
            self.now = now
            self.simulator.AdvanceTo(now)

    def read(self, port):
        value = self.station.GetOutputPort(port).Eval(self.context)
        return value if isinstance(value, np.ndarray) else value.data.copy()


def test_the_ports_are_those_of_every_station():
    station = Bench().station
    check_contract(station)
    names = [station.get_output_port(k).get_name() for k in range(station.num_output_ports())]
    assert names == [port.name for port in STATION_OUTPUTS]
    assert station.get_input_port(0).get_name() == STATION_INPUTS[0].name


def test_before_the_first_picture_there_is_none():
    bench = Bench()
    bench.advance(START + 0.2)
    assert bench.read("wrist.image_time")[0] < 0
    assert bench.read("wrist.color_image").size == 0


@pytest.mark.parametrize("latency", [0.0, 0.04])
def test_a_picture_comes_with_the_joint_angles_of_its_own_time(latency):
    config = HardwareStationConfig()
    config.camera.latency = latency
    bench = Bench(config)
    bench.moving_arm(START + 0.5)
    bench.picture(START + 0.333)
    bench.advance(START + 0.6)
    assert bench.read("wrist.image_time")[0] == pytest.approx(START + 0.333, abs=1e-6)
    np.testing.assert_allclose(bench.read("panda.position_measured"), READY + 0.333 - latency, atol=1e-5)
    assert bench.read("wrist.color_image").shape == (480, 640, 4)
    np.testing.assert_allclose(bench.read("wrist.depth_image"), 0.5, atol=1e-6)


def test_a_picture_whose_arm_is_not_known_yet_waits_for_it():
    bench = Bench()
    bench.moving_arm(START + 0.1)
    bench.picture(START + 0.2)
    bench.advance(START + 0.3)
    assert bench.read("wrist.image_time")[0] < 0
    bench.moving_arm(START + 0.3)
    bench.advance(START + 0.5)
    assert bench.read("wrist.image_time")[0] > 0


def test_an_older_picture_that_comes_late_is_not_shown():
    bench = Bench()
    bench.moving_arm(START + 1)
    bench.picture(START + 0.4, gray=200)
    bench.advance(START + 0.5)
    bench.picture(START + 0.3, gray=50)
    bench.advance(START + 1)
    assert bench.read("wrist.image_time")[0] == pytest.approx(START + 0.4, abs=1e-6)
    assert bench.read("wrist.color_image")[0, 0, 0] > 150


def test_depth_out_of_the_cameras_range_is_invalid():
    bench = Bench()
    bench.moving_arm(START + 0.5)
    bench.picture(START + 0.3, depth=0.2)
    bench.advance(START + 0.5)
    assert not bench.read("wrist.depth_image").any()


def test_a_diagram_that_is_late_catches_up_before_it_looks_at_another_picture():
    bench = Bench()
    bench.moving_arm(START + 1)
    bench.picture(START + 0.9)
    bench.now = START + 1.0
    bench.simulator.AdvanceTo(START + 0.8)
    assert bench.read("wrist.image_time")[0] < 0
    bench.simulator.AdvanceTo(START + 1.0)
    assert bench.read("wrist.image_time")[0] > 0


def test_depth_that_is_not_aligned_is_refused_with_the_flag_to_set():
    bench = Bench()

    def show():
        for time in START + np.arange(0.1, BLIND + 0.5, 0.1):
            bench.picture(time, aligned=False)
            bench.advance(time + 0.1)

    with pytest.raises(ImageError, match="--software_depth_registration"):
        show()
    assert bench.now - START >= BLIND


def test_targets_go_out_every_ten_milliseconds_with_the_time_they_are_meant_for():
    bench = Bench()
    bench.advance(START + 0.1)
    times = np.array([time for time, _ in bench.sent])
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-5)
    np.testing.assert_array_equal(bench.sent[-1][1], READY)


def test_a_replayed_log_counts_as_now():
    bench = Bench(replayed=True)
    recorded = 1_600_000_000.0
    bench.status(recorded, READY)
    bench.now = START + 0.1
    bench.status(recorded + 0.1, READY + 0.1)
    bench.picture(recorded + 0.05)
    bench.advance(START + 0.2)
    assert bench.read("wrist.image_time")[0] == pytest.approx(START + 0.05, abs=1e-6)
    np.testing.assert_allclose(bench.read("panda.position_measured"), READY + 0.05, atol=1e-5)


@pytest.mark.parametrize("step", [-1.0, -0.05, 0.05, 1.0])
def test_a_clock_that_is_set_changes_neither_the_pairing_nor_the_flow_of_pictures(step):
    bench = Bench()
    bench.moving_arm(START + 0.5)
    bench.picture(START + 0.4)
    bench.advance(START + 0.5)
    bench.set_by = step
    for time in np.arange(START + 0.51, START + 1, 0.01):
        bench.status(time, READY + (time - START))  # stamped by the clock as it is now
    bench.picture(START + 0.75)
    bench.advance(START + 1.0)
    assert bench.read("wrist.image_time")[0] == pytest.approx(START + 0.75, abs=1e-6)
    np.testing.assert_allclose(bench.read("panda.position_measured"), READY + 0.75, atol=1e-5)


def test_a_status_or_a_picture_stamped_an_hour_ahead_changes_nothing():
    bench = Bench()
    bench.moving_arm(START + 0.5)
    for message in (status_message(START + 3600, READY), picture_message(START + 3600)):
        channel = bench.config.lcm.image_channel if message.__class__ is lcmt_image_array else "PANDA_STATUS"
        bench.lcm.Publish(channel, message.encode())
        bench.reception.listen()
    for time in np.arange(START + 0.51, START + 1, 0.01):
        bench.status(time, READY + (time - START))
    bench.picture(START + 0.75)
    bench.advance(START + 1.0)
    np.testing.assert_allclose(bench.read("panda.position_measured"), READY + 0.75, atol=1e-5)
    assert sum(bench.reception.left_out.values()) == len(bench.reception.untold()) == 2


def cut_off(data):
    return data[: len(data) // 2]


def with_damaged_pixels(data):
    return data[:400] + bytes(len(data) - 800) + data[-400:]


@pytest.mark.parametrize("damage", [cut_off, with_damaged_pixels])
def test_a_damaged_picture_is_left_out_and_counted_and_the_next_one_is_shown(damage):
    bench = Bench()
    bench.moving_arm(START + 1)
    color, depth = np.full((480, 848, 3), 90, np.uint8), np.full((480, 848), 0.5, np.float32)
    data = encode_images(color, depth, START + 0.4, START + 0.43, 0).encode()
    bench.lcm.Publish(bench.config.lcm.image_channel, damage(data))
    bench.reception.listen()
    bench.advance(START + 0.6)
    assert bench.read("wrist.image_time")[0] < 0
    assert sum(bench.reception.left_out.values()) == 1
    bench.picture(START + 0.7)
    bench.advance(START + 1)
    assert bench.read("wrist.image_time")[0] == pytest.approx(START + 0.7, abs=1e-6)


def test_a_camera_that_stamps_by_a_clock_of_its_own_is_told():
    bench = Bench()
    bench.moving_arm(START + 1)
    color, depth = np.full((480, 848, 3), 90, np.uint8), np.full((480, 848), 0.5, np.float32)
    bench.lcm.Publish(
        bench.config.lcm.image_channel, encode_images(color, depth, 17.0, START + 0.9, 0).encode()
    )
    bench.reception.listen()
    bench.advance(START + 1)
    (line,) = bench.reception.untold()
    assert "global time" in line
