import numpy as np
import pytest
from drake import lcmt_panda_command

from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.stations.panda_driver import (
    IDLE,
    MOVE,
    REFLEX,
    USER_STOPPED,
    DriverEndedError,
    PandaDriver,
    PandaDriverConfig,
    limit_rate,
)

START = 1_700_000_000_000_000  # us
SHOULDER = np.array([0, 1.0, 0, 0, 0, 0, 0])
WRIST = np.array([0, 0, 0, 0, 0, 0, 1.0])
MODES = {"position": 1, "velocity": 2}


def command(mode, values, utime, **changes):
    message = lcmt_panda_command()
    message.utime = utime
    message.control_mode_expected = MODES[mode]
    setattr(message, f"joint_{mode}", list(values))
    setattr(message, f"num_joint_{mode}", len(values))
    for name, value in changes.items():
        setattr(message, name, value)
    return message


class Session:
    """A driver, and a client that sends at 200 Hz."""

    def __init__(self, mode="position"):
        self.mode = mode
        self.driver = PandaDriver(PandaDriverConfig(control_mode=mode), READY)
        self.now = START

    def wait(self, ticks):
        for _ in range(ticks):
            self.now += 1000
            self.driver.tick(self.now)
        return self

    def send(self, values, stamp_error=0, ticks=5, **changes):
        self.driver.receive(command(self.mode, values, self.now + stamp_error, **changes))
        return self.wait(ticks)

    @property
    def mode_now(self):
        return self.driver.robot_mode


def smooth(share):
    """From 0 to 1 without a jump of velocity or acceleration."""
    return share**3 * (10 - 15 * share + 6 * share**2)


def swing(duration, amplitude):
    """A smooth motion of all joints by `amplitude`, rad, at 200 Hz; what is sent at t in s."""
    return lambda t: READY + amplitude * smooth(np.clip(t / duration, 0, 1))


def test_before_any_command_the_arm_stands_where_it_is():
    driver = Session().wait(100).driver
    assert driver.robot_mode == MOVE
    np.testing.assert_array_equal(driver.q_d, READY)


@pytest.mark.parametrize("seed", range(5))
def test_a_smooth_stream_with_jitter_and_lost_messages_is_followed(seed):
    rng = np.random.default_rng(seed)
    # 0.35 rad in 1 s: at most 0.66 rad/s and 2.0 rad/s^2.
    path, session = swing(1.0, 0.35), Session()
    worst = 0.0
    for k in range(240):
        t = 0.005 * k
        error = int(rng.uniform(-1500, 1500))
        if rng.uniform() < 0.1:
            session.wait(5)
        else:
            session.send(path(t), stamp_error=error)
        assert session.mode_now == MOVE, session.driver.reflex_reason
        worst = max(worst, np.abs(session.driver.q_d - path(t)).max())
    np.testing.assert_allclose(session.driver.q_d, READY + 0.35, atol=1e-4)
    assert worst < 0.012


def test_the_arm_follows_a_ramp_with_the_lag_of_the_filter():
    session = Session()
    rate = 0.1
    for k in range(400):
        t = 0.005 * k
        session.send(READY + rate * max(0.0, t - 0.5 * (1 - np.exp(-t / 0.5))))
    lag = (READY[0] + rate * (t - 0.5 * (1 - np.exp(-t / 0.5)))) - session.driver.q_d[0]
    # The pole that 1 / (2 pi 30 Hz) = 5.3 ms gives, seen 5 ms after the step of the held command.
    assert 0 < lag < rate * 0.0053
    assert session.driver.v_d[0] == pytest.approx(rate, rel=0.6)


@pytest.mark.parametrize("step", [0.002, 0.01, 0.1])
def test_a_step_from_rest_is_a_reflex_and_a_tiny_one_is_not(step):
    session = Session().send(READY).send(READY)
    assert session.send(READY + 1e-4).mode_now == MOVE
    session.send(READY + 1e-4 + step)
    assert (session.mode_now, session.driver.reflex_reason) == (
        REFLEX,
        "joint_motion_generator_velocity_discontinuity",
    )
    assert np.abs(session.wait(200).driver.q_d - READY).max() < 2e-4  # nothing of the step was done


def test_a_first_command_far_from_the_present_position_is_a_reflex():
    assert Session().wait(50).send(READY + 0.01).mode_now == REFLEX


def test_a_stop_from_one_command_to_the_next_is_a_reflex():
    path, session = swing(1.0, 0.35), Session()
    for k in range(100):
        session.send(path(0.005 * k))
    assert session.mode_now == MOVE
    for _ in range(10):
        session.send(path(0.005 * 99))
    assert session.mode_now == REFLEX


def test_smooth_but_too_fast_or_too_hard_is_a_reflex():
    for duration, amplitude, reason in (
        (1.5, WRIST * 2.4, "velocity_limits"),  # 3 rad/s, 6.2 rad/s^2
        (0.3, 0.3 * SHOULDER, "acceleration_discontinuity"),  # 1.9 rad/s, 19 rad/s^2
    ):
        path, session = swing(duration, amplitude), Session()
        for k in range(int(duration / 0.005)):
            session.send(path(0.005 * k))
        assert reason in session.driver.reflex_reason


def test_just_within_the_limits_is_no_reflex():
    duration = 1.2
    amplitude = 0.85 * duration * PANDA_LIMITS.velocity.min() / 1.875  # its peak speed is 85 % of the limit
    amplitude = min(amplitude, 0.8 * duration**2 * PANDA_LIMITS.acceleration.min() / 5.774)
    path, session = swing(duration, np.array([1, 0, 0, 0, 0, 0, 0]) * amplitude), Session()
    for k in range(260):
        session.send(path(0.005 * k))
    assert session.mode_now == MOVE, session.driver.reflex_reason


def test_leaving_the_joint_range_is_a_reflex():
    session = Session()
    for k in range(2000):
        session.send(READY + WRIST * 3.5 * smooth(min(1.0, k / 1600)))
    assert session.driver.reflex_reason == "joint_motion_generator_position_limits_violation"
    assert PANDA_LIMITS.contains(session.wait(200).driver.q_d, margin=-0.01)  # it had to brake


def test_an_expired_position_holds_and_the_stream_may_go_on_from_there():
    path, session = swing(1.0, 0.35), Session()
    for k in range(60):
        session.send(path(0.005 * k))
    held = path(0.005 * 59)
    session.wait(700)
    np.testing.assert_allclose(session.driver.q_d, held, atol=1e-5)
    assert session.send(held).send(held).mode_now == MOVE
    assert session.wait(300).send(held + 0.01).mode_now == REFLEX


def test_what_a_driver_that_was_kept_from_running_has_missed_is_not_held_against_the_client():
    path, session = swing(1.0, 0.35), Session()
    for k in range(60):
        session.send(path(0.005 * k))
    session.now += 200_000  # its process slept, and heard nothing
    session.driver.miss()
    for k in range(100, 240):
        session.send(path(0.005 * k))
        assert session.mode_now == MOVE, session.driver.reflex_reason
    assert session.send(READY).mode_now == REFLEX  # it judges again


@pytest.mark.parametrize("mode", MODES)
def test_a_stream_that_paused_may_go_on_or_begin_at_rest_and_nothing_else(mode):
    def speed(t):
        return 0.3 * smooth(min(1.0, t / 0.5))

    def paused(pause, following):
        session, position = Session(mode), READY
        for k in range(120):
            position = position + 0.005 * speed(0.005 * k)
            session.send(position if mode == "position" else np.full(7, speed(0.005 * k)))
        session.wait(pause)
        return session.send(following(position) if mode == "position" else following(0.0)).mode_now

    if mode == "position":
        assert paused(45, lambda q: q + 0.05 * 0.3) == MOVE  # where it should be by now
        assert paused(45, lambda q: q) == paused(80, lambda q: q) == MOVE
        assert paused(10, lambda q: q) == REFLEX  # a stop from full speed
        assert paused(80, lambda q: q - 0.02) == REFLEX
    else:
        assert paused(45, lambda v: np.full(7, 0.3)) == paused(80, lambda v: np.zeros(7)) == MOVE
        assert paused(10, lambda v: np.zeros(7)) == REFLEX
        assert paused(80, lambda v: np.full(7, -0.3)) == REFLEX


def test_rates_are_limited_as_by_libfranka():
    # A step of velocity: jerk takes 2 ms to the full acceleration, which then holds.
    v, a, speeds = np.zeros(7), np.zeros(7), []
    for _ in range(20):
        v_next = limit_rate(np.full(7, 1.0), v, a)
        v, a = v_next, (v_next - v) / 1e-3
        speeds.append(v)
    ticks = np.arange(1, 21)
    expected = np.cumsum(np.minimum(0.5 * ticks, 1.0)) * 1e-3 * PANDA_LIMITS.acceleration[0]
    np.testing.assert_allclose(np.array(speeds)[:, 0], expected, rtol=1e-9)


def test_the_greatest_speed_is_neared_and_never_passed():
    v, a = np.zeros(7), np.zeros(7)
    for _ in range(1000):
        v_next = limit_rate(np.full(7, 9.0), v, a)
        v, a = v_next, (v_next - v) / 1e-3
    assert (v <= PANDA_LIMITS.velocity).all()
    np.testing.assert_allclose(v, PANDA_LIMITS.velocity, rtol=1e-3)


def test_a_hold_at_speed_is_overshot_as_no_limiter_brakes_ahead_of_time():
    path, session = swing(1.0, 0.35), Session()
    for k in range(100):  # 0.66 rad/s
        session.send(path(0.005 * k))
    farthest = max(session.wait(1).driver.q_d[1] for _ in range(500)) - path(0.005 * 99)[1]
    # Braking with 7.5 rad/s^2 takes 29 mm of arc; 30 Hz and the held command leave 5 of them.
    assert 0.012 < farthest < 0.03
    session.wait(1500)
    np.testing.assert_allclose(session.driver.q_d, path(0.005 * 99), atol=1e-4)


@pytest.mark.parametrize(("age_ms", "moves"), [(95, True), (105, False), (-105, False)])
def test_a_command_expires_a_tenth_of_a_second_from_its_stamp_in_either_direction(age_ms, moves):
    session = Session("velocity")
    session.send(np.full(7, 0.05), stamp_error=-1000 * age_ms, ticks=2)
    assert (np.abs(session.driver.v_d).max() > 0) == moves


def test_velocity_is_held_until_it_expires_and_then_ends_within_the_acceleration_limit():
    session = Session("velocity")
    for k in range(100):
        session.send(np.full(7, 0.3 * smooth(min(1.0, k / 60))))
    np.testing.assert_allclose(session.driver.v_d, 0.3, atol=1e-3)
    before = session.driver.q_d
    session.wait(90)
    np.testing.assert_allclose(session.driver.q_d - before, 0.027, atol=1e-4)
    speeds = [session.wait(1).driver.v_d for _ in range(150)]
    np.testing.assert_allclose(speeds[-1], 0, atol=1e-6)
    assert (np.abs(np.diff(speeds, axis=0)) <= PANDA_LIMITS.acceleration * 1e-3 + 1e-12).all()
    assert session.mode_now == MOVE


@pytest.mark.parametrize(
    ("values", "reason"),
    [(np.full(7, 0.5), "acceleration_discontinuity"), (np.full(7, 3.0), "velocity_limits")],
)
def test_a_jump_of_velocity_is_a_reflex(values, reason):
    session = Session("velocity").send(np.zeros(7)).send(values)
    assert session.mode_now == REFLEX
    assert reason in session.driver.reflex_reason


def spoiled(mode, **changes):
    return lambda session: session.send(READY if mode == "position" else np.zeros(7), **changes)


@pytest.mark.parametrize(
    ("mode", "changes", "words"),
    [
        ("position", {"control_mode_expected": 2}, "control_mode_expected is 2"),
        ("position", {"control_mode_expected": 0}, "control_mode_expected is 0"),
        ("position", {"control_mode_expected": 3}, "control_mode_expected is 3"),
        ("velocity", {"control_mode_expected": 1}, "control_mode_expected is 1"),
        ("position", {"num_joint_velocity": 7}, "joint_velocity must be empty"),
        ("velocity", {"num_joint_position": 7}, "joint_position must be empty"),
        ("position", {"num_joint_torque": 7}, "joint_torque must be empty"),
        ("position", {"num_joint_position": 6}, "joint_position has 6 values"),
        ("velocity", {"num_joint_velocity": 0}, "joint_velocity has 0 values"),
        ("position", {"joint_position": [np.nan] * 7}, "infinite or NaN"),
    ],
)
def test_the_driver_ends_on_a_command_it_was_not_started_for(mode, changes, words):
    with pytest.raises(DriverEndedError, match=words):
        spoiled(mode, **changes)(Session(mode))


def test_a_wrong_mode_ends_the_driver_even_when_expired_but_a_wrong_size_does_not():
    with pytest.raises(DriverEndedError):
        Session().send(READY, stamp_error=-500_000, control_mode_expected=2)
    assert Session().send(READY, stamp_error=-500_000, num_joint_position=6).mode_now == MOVE


@pytest.mark.parametrize("event", ["reflex", "stop"])
def test_after_a_stop_only_the_operators_word_brings_the_arm_back(event):
    path, session = swing(1.0, 0.35), Session()
    for k in range(100):
        session.send(path(0.005 * k))
    if event == "reflex":
        session.driver.enter_reflex("asked for")
    else:
        session.driver.user_stop()
    speeds = [session.wait(1).driver.v_d for _ in range(300)]
    assert (np.abs(np.diff(speeds, axis=0)) <= PANDA_LIMITS.acceleration * 1e-3 + 1e-12).all()
    stopped = session.driver.q_d
    session.send(path(0.5)).send(path(0.51))
    assert session.mode_now == (REFLEX if event == "reflex" else USER_STOPPED)
    np.testing.assert_array_equal(session.driver.q_d, stopped)
    session.driver.restart()
    assert session.send(stopped).send(stopped).mode_now == MOVE


def test_status_only_listens_to_nothing():
    session = Session("position")
    session.driver = PandaDriver(PandaDriverConfig(control_mode="status_only"), READY)
    assert session.send(READY + 1, control_mode_expected=7).mode_now == IDLE
    np.testing.assert_array_equal(session.driver.q_d, READY)
