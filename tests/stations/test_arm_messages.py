import struct

import numpy as np
import pytest
from drake import lcmt_image_array, lcmt_panda_status

from riseg_drake.robot.kinematics import READY
from riseg_drake.stations.arm_messages import (
    AHEAD,
    CONTINUOUS,
    PICTURE_BYTES,
    STATUS_BYTES,
    PictureDoor,
    StatusDoor,
    array_time,
)
from riseg_drake.stations.ideal_arm import status_message
from riseg_drake.stations.lcm_images import encode_images
from tests.stations.mutated_messages import picture_message

NOW, SHIFT = 5000.0, -1_700_000_000.0
"""By the clock of whoever asks, s, and what brings stamps there."""


def said(before=0.0, **fields):
    """A status of a moment ago, s, in bytes."""
    message = status_message(NOW - SHIFT - before, READY)
    for name, value in fields.items():
        setattr(message, name, value)
    return message.encode()


def with_entry(index, value):
    entries = [0.0] * 7
    entries[index] = value
    return entries


def at(index, value):
    q = READY.copy()
    q[index] = value
    return q.tolist()


def test_the_sizes_are_those_of_encoded_messages():
    assert len(said()) == STATUS_BYTES
    assert len(lcmt_image_array().encode()) == PICTURE_BYTES


def test_a_good_status_comes_through_with_its_time_by_the_clock_of_whoever_asks():
    status = StatusDoor().admit(said(0.02, joint_velocity=with_entry(3, 0.5), robot_mode=4), NOW, SHIFT)
    assert status.time == pytest.approx(NOW - 0.02, abs=1e-6)
    np.testing.assert_array_equal(status.position, READY)
    assert status.velocity[3] == 0.5
    assert status.robot_mode == 4


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no lcmt_panda_status (0 bytes)"),
        (said()[:19], "no lcmt_panda_status"),
        (b"x" + said()[1:], "no lcmt_panda_status"),
        (lcmt_image_array().encode(), "no lcmt_panda_status"),
        (said()[:300], "too short or too long (300 bytes, not 486)"),
        (said() + b"x", "too short or too long"),
        *[
            (said()[:16] + struct.pack(">i", n) + said()[20:], f"num_joints is {n}")
            for n in (0, 6, 8, -1, 2**31 - 1)
        ],
        (said(joint_position=at(2, np.nan)), "no numbers"),
        (said(joint_velocity=with_entry(6, np.inf)), "no numbers"),
        (said(joint_torque_external=with_entry(0, np.nan)), "no numbers"),
        (said(joint_position=at(3, 0.6)), "joint angles that no arm has"),
        (said(joint_velocity=with_entry(0, 9.0)), "velocities that no arm has"),
        (said(joint_torque_external=with_entry(6, 1e9)), "external torques that no arm has"),
        (said(robot_mode=7), "robot_mode that is not known (7)"),
        (said(robot_mode=-1), "robot_mode that is not known (-1)"),
        (said(-0.03), "ahead of this computer's clock (by 0.030 s"),
        (said(-3600.0), "ahead of this computer's clock (by 3600.000 s"),
        (said(utime=2**63 - 1), "ahead of this computer's clock"),
        (said(3600.0), "far behind this computer's clock (by 3600.0 s"),
    ],
)
def test_what_cannot_be_is_left_out_counted_and_told_once(data, words):
    door = StatusDoor("ARM")
    assert door.admit(said(1.0), NOW, SHIFT)
    for _ in range(3):
        assert door.admit(data, NOW, SHIFT) is None
    assert list(door.refused.counts.values()) == [3]
    (line,) = door.refused.untold()
    assert line.startswith("ARM: a message was left out: ")
    assert words in line
    assert not door.refused.untold()
    assert door.admit(said(), NOW, SHIFT)


@pytest.mark.parametrize("field", ["joint_position_desired", "joint_torque", "joint_acceleration_desired"])
def test_what_is_not_used_may_be_anything(field):
    assert StatusDoor().admit(said(**{field: with_entry(1, np.nan)}), NOW, SHIFT)


def test_clocks_that_differ_by_milliseconds_are_good_enough():
    assert StatusDoor().admit(said(-0.9 * AHEAD), NOW, SHIFT)


def test_a_late_one_is_counted_and_one_that_came_twice_is_not():
    door = StatusDoor()
    assert door.admit(said(0.01), NOW, SHIFT)
    assert door.admit(said(0.01), NOW, SHIFT) is None
    assert not door.refused.counts
    assert door.admit(said(0.02), NOW, SHIFT) is None
    assert sum(door.refused.counts.values()) == 1


@pytest.mark.parametrize(
    ("later", "step", "goes_through"),
    [
        (0.005, 0.0005, True),  # noise
        (0.005, 0.01, True),
        (0.005, 0.1, False),
        (0.05, 0.1, True),  # 2 rad/s
        (0.05, 0.3, False),
        (1.1 * CONTINUOUS, 0.3, True),  # somebody may have moved it while the driver was gone
    ],
)
def test_an_arm_does_not_jump(later, step, goes_through):
    door = StatusDoor()
    assert door.admit(said(later), NOW, SHIFT)
    assert bool(door.admit(said(joint_position=at(0, READY[0] + step)), NOW, SHIFT)) is goes_through


@pytest.mark.parametrize(
    ("robot_time", "goes_through"), [(0.005, True), (0.0, True), (-1.0, False), (7.0, False)]
)
def test_a_robot_has_one_clock(robot_time, goes_through):
    door, start = StatusDoor(), 9_000_000
    assert door.admit(said(0.005, robot_utime=start), NOW, SHIFT)
    data = said(robot_utime=start + round(1e6 * robot_time))
    assert bool(door.admit(data, NOW, SHIFT)) is goes_through


def test_one_damaged_message_is_no_second_driver_and_three_in_half_a_second_are():
    door = StatusDoor()
    assert door.admit(said(0.1), NOW, SHIFT)
    for k in range(3):
        assert not door.contradicts_itself(NOW + 0.01 * k)
        door.admit(said(0.09, joint_position=at(0, 1.0)), NOW + 0.01 * k, SHIFT)
    assert door.contradicts_itself(NOW + 0.02)
    assert not door.contradicts_itself(NOW + 0.6)


def test_a_picture_comes_through_with_the_time_at_which_it_was_sent():
    color, depth = np.zeros((4, 6, 3), np.uint8), np.ones((4, 6), np.float32)
    data = encode_images(color, depth, NOW - SHIFT - 0.05, NOW - SHIFT - 0.02, 3).encode()
    assert array_time(data) == pytest.approx(NOW - SHIFT - 0.02, abs=1e-6)
    assert PictureDoor().admit(data, NOW, SHIFT) == pytest.approx(NOW - 0.02, abs=1e-6)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no lcmt_image_array"),
        (picture_message(NOW - SHIFT).encode()[:19], "no lcmt_image_array"),
        (lcmt_panda_status().encode(), "no lcmt_image_array"),
        (picture_message(NOW - SHIFT + 0.03).encode(), "ahead"),
        (picture_message(NOW - SHIFT - 3600).encode(), "far behind"),
        (picture_message(NOW - SHIFT - 1).encode(), "after a later one"),
    ],
)
def test_a_message_of_no_camera_or_another_time_is_left_out(data, words):
    door = PictureDoor()
    assert door.admit(picture_message(NOW - SHIFT - 0.1).encode(), NOW, SHIFT)
    assert door.admit(data, NOW, SHIFT) is None
    assert words in door.refused.untold()[0]
    assert door.admit(picture_message(NOW - SHIFT).encode(), NOW, SHIFT)
