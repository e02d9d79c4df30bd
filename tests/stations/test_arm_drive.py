import numpy as np
import pytest

from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import FR3_LIMITS, PANDA_LIMITS
from riseg_drake.robot.supervisor import MOVE, REFLEX, USER_STOPPED
from riseg_drake.stations.arm_drive import EXPIRY, HELD, LIMITS, Drive
from riseg_drake.stations.rate_limiter import TICK
from tests.stations.driven_robot import ROBOT, WALL, DrivenRobot, command, word

MODES = ("position", "velocity")
STOP = round(1e3 * (EXPIRY + LIMITS.longest_stop(FR3_LIMITS)))  # ticks


def is_within_limits(robot):
    jerk, acceleration, velocity = robot.largest
    return jerk <= LIMITS.stop_jerk + 1e-4 and acceleration <= LIMITS.acceleration + 1e-6 and velocity <= 1


def stood_still(robot, ticks=50):
    return np.ptp(robot.path[-ticks:], axis=0).max() < 1e-9


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("limits", [FR3_LIMITS, PANDA_LIMITS])
def test_a_smooth_stream_at_200_hz_is_followed_20_ms_behind_within_a_tenth_of_a_milliradian(mode, limits):
    robot = DrivenRobot(mode, limits=limits).swing(1.5)
    planned = [robot.planned(READY, WALL + k * TICK - 0.02)[0] for k in range(1, 1501)]
    # A tick later the robot is where it is told to be.
    assert np.abs(np.array(robot.path)[1:] - np.array(planned)[1:]).max() < 1e-4 + 0.32 * TICK
    assert robot.drive.state is Drive.FOLLOWING
    assert robot.largest[0] < 0.5
    assert robot.largest[1] < 0.5


@pytest.mark.parametrize("mode", MODES)
def test_commands_that_are_up_to_15_ms_late_and_out_of_order_change_the_motion_by_nothing(mode):
    even = DrivenRobot(mode).swing(1.0)
    rng = np.random.default_rng(1)
    delays = rng.choice([0.0, 0.005, 0.009], 200)
    late = DrivenRobot(mode).swing(1.0, late=lambda k: delays[k])
    if mode == "position":  # one that comes after a later one is left out: of a smooth path nobody misses it
        assert np.abs(np.array(late.path) - np.array(even.path)).max() < 3e-4
    assert late.drive.state is Drive.FOLLOWING
    assert is_within_limits(late)


@pytest.mark.parametrize("mode", MODES)
def test_where_commands_end_in_motion_the_arm_brakes_within_limits_holds_says_so_and_wants_a_word(mode):
    robot = DrivenRobot(mode).swing(0.6)
    assert np.abs(robot.v).max() > 0.05
    robot.wait(STOP)
    assert robot.drive.state is Drive.EXPIRED
    assert robot.status.robot_mode == HELD
    assert robot.said == ["holds: commands ended in motion: none for 0.1 s; waits for the operator's word"]
    assert stood_still(robot)
    assert is_within_limits(robot)
    held = robot.q
    robot.swing(0.3)
    np.testing.assert_allclose(robot.q, held, atol=1e-12)
    robot.tick(words=[word(robot.now)])
    assert robot.drive.state is Drive.WAITING
    assert robot.tick().status.robot_mode == MOVE
    robot.swing(0.3)
    assert robot.drive.state is Drive.FOLLOWING
    assert is_within_limits(robot)


@pytest.mark.parametrize("mode", MODES)
def test_commands_that_end_at_rest_may_begin_again_without_a_word(mode):
    robot = DrivenRobot(mode)
    for _ in range(10):
        robot.tick(command(mode, READY if mode == "position" else np.zeros(7), robot.now))
        robot.wait(4)
    robot.wait(2 * STOP)
    assert (robot.drive.state, robot.said, robot.status.robot_mode) == (Drive.WAITING, [], MOVE)
    robot.swing(0.3)
    assert robot.drive.state is Drive.FOLLOWING


BAD = {
    "NaN": lambda mode, q: command(mode, np.full(7, np.nan), 0),
    "infinite": lambda mode, q: command(mode, np.full(7, np.inf), 0),
    "six values": lambda mode, q: command(mode, q[:6], 0),
    "the other mode": lambda mode, q: command({"position": "velocity"}.get(mode, "position"), q, 0),
    "far off": lambda mode, q: command(mode, q + (0.3 if mode == "position" else 300.0), 0),
}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", BAD)
def test_after_a_command_that_is_none_the_arm_brakes_within_limits_and_wants_a_word(mode, kind):
    robot = DrivenRobot(mode).swing(0.6)
    bad = BAD[kind](mode, robot.q)
    bad.utime = round(1e6 * robot.now)
    robot.tick(bad)
    robot.swing(0.4)
    assert robot.drive.state is Drive.REFUSED
    assert robot.status.robot_mode == HELD
    assert len(robot.said) == 1
    assert stood_still(robot)
    assert is_within_limits(robot)


@pytest.mark.parametrize(("off", "state"), [(0.099, Drive.FOLLOWING), (0.101, Drive.REFUSED)])
def test_joint_angles_may_begin_a_tenth_of_a_radian_from_where_the_arm_is_and_no_further(off, state):
    robot = DrivenRobot()
    for _ in range(600):
        robot.tick(command("position", READY + off * np.array([0, 0, 1, 0, 0, 0, 0]), robot.now))
    assert robot.drive.state is state
    assert np.abs(robot.q - READY).max() == pytest.approx(off if state is Drive.FOLLOWING else 0.0, abs=1e-6)
    assert is_within_limits(robot)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("jump", "followed"), [(0.6, 1.0), (-0.6, 1.0), (0.4, 1e-3), (-0.4, 1e-3)])
def test_a_clock_that_was_set_by_half_a_second_is_followed_at_once_and_less_within_a_second(
    mode, jump, followed
):
    robot = DrivenRobot(mode)
    before = robot.tick().status.utime
    after = robot.tick(late=jump).status.utime
    assert 1e-6 * (after - before) == pytest.approx(TICK + followed * jump, abs=1e-5)
    for _ in range(1000):
        last = robot.tick(late=jump).status.utime
    assert 1e-6 * last - robot.now == pytest.approx(jump * (1 - 0.999**1001 * (followed < 1)), abs=1e-5)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("age", [-0.2, 0.2, 3600.0])
def test_stamps_that_are_not_of_now_move_nothing(mode, age):
    robot = DrivenRobot(mode)
    for k in range(100):
        robot.tick(command(mode, READY + 1e-3 * k, robot.now - age))
    assert robot.drive.state is Drive.WAITING
    np.testing.assert_array_equal(robot.q, READY)


@pytest.mark.parametrize("lost", [2, 5, 15])
@pytest.mark.parametrize("mode", MODES)
def test_ticks_that_were_missed_are_gone_on_from_where_the_robot_has_extrapolated_to(mode, lost):
    robot = DrivenRobot(mode).swing(0.6)
    for _ in range(lost):  # the robot keeps its acceleration
        robot.ticks += 1
        robot.v = robot.v + TICK * robot.a
        robot.q = robot.q + TICK * robot.v
    robot.wait(1)
    assert is_within_limits(robot)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("robot_mode", "reason"), [(REFLEX, "joint_reflex"), (USER_STOPPED, "stop button")])
def test_a_robot_that_stopped_is_told_as_it_is_and_recovered_at_a_word_that_came_after(
    mode, robot_mode, reason
):
    robot = DrivenRobot(mode).swing(0.6)
    robot.robot_mode = robot_mode
    before = word(robot.now - TICK)
    assert robot.drive.lose(robot.now, reason) == [
        f"the robot takes no commands: {reason}; waits for the operator's word"
    ]
    assert robot.drive.lose(robot.now, reason) == []
    output = robot.tick(words=[before])
    assert (output.command, output.recover, output.status.robot_mode) == (None, False, robot_mode)
    assert robot.tick(words=[word(robot.now - 1.0)]).recover is False
    assert robot.tick(words=[word(robot.now)]).recover is True
    robot.robot_mode, robot.q, robot.v, robot.a = MOVE, READY + 0.3, np.zeros(7), np.zeros(7)
    robot.drive.begin(robot.reading())
    assert robot.drive.state is Drive.WAITING
    np.testing.assert_allclose(robot.tick().command, READY + 0.3 if mode == "position" else 0, atol=1e-12)


@pytest.mark.parametrize(("age", "counts"), [(1.98, True), (2.02, False), (-0.09, True), (-0.11, False)])
def test_a_word_counts_for_two_seconds_and_from_a_tenth_of_a_second_ahead(age, counts):
    robot = DrivenRobot().swing(0.6)
    robot.drive.lose(robot.now, "joint_reflex")
    robot.robot_mode = REFLEX
    robot.ticks += 3000
    assert robot.tick(words=[word(robot.now - age)]).recover is counts


@pytest.mark.parametrize("mode", MODES)
def test_the_status_is_stamped_evenly_however_late_the_process_is_woken(mode):
    robot = DrivenRobot(mode)
    rng = np.random.default_rng(2)
    stamps = [robot.tick(late=late).status.utime for late in rng.choice([0, 0, 0, 0.004, 0.02], 500)]
    assert (np.diff(stamps) > 950).all()
    assert (np.diff(stamps) < 1050).all()
    assert robot.status.robot_utime == round(1e6 * (ROBOT + 0.5))


@pytest.mark.parametrize("mode", MODES)
def test_told_to_end_in_motion_it_brakes_first(mode):
    robot = DrivenRobot(mode).swing(0.6)
    at_once = int(np.ceil(robot.drive._limiter._stop.duration / TICK))
    robot.drive.end()
    ticks = 1
    while not robot.tick().finished:
        ticks += 1
    assert ticks == at_once
    assert at_once > 5
    assert stood_still(robot.wait(60))
    assert is_within_limits(robot)
