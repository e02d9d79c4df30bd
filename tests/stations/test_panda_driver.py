import numpy as np
import pytest
from drake import lcmt_panda_command

from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.stations.panda_driver import ABORTED, ENDED, KILLED, PandaDriver, PandaDriverConfig
from riseg_drake.stations.panda_robot import GUIDING, HAND_SPEED, IDLE, MOVE, REFLEX, USER_STOPPED

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

    def __init__(self, mode="position", **config):
        self.mode = mode
        self.driver = PandaDriver(PandaDriverConfig(control_mode=mode, **config), READY, PANDA_LIMITS)
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
    def robot(self):
        return self.driver.robot

    @property
    def follows(self):
        return self.driver.end is None and self.robot.mode == MOVE

    @property
    def is_reflex(self):
        end = self.driver.end
        return end is not None and (end.code, end.reason[:6], self.robot.mode) == (ENDED, "reflex", IDLE)

    def start(self):
        assert self.driver.start(self.now)
        return self.wait(round(1e3 * self.driver.config.startup))


def smooth(share):
    """From 0 to 1 without a jump of velocity or acceleration."""
    return share**3 * (10 - 15 * share + 6 * share**2)


def swing(duration, amplitude):
    """A smooth motion of all joints by `amplitude`, rad, at 200 Hz; what is sent at t in s."""
    return lambda t: READY + amplitude * smooth(np.clip(t / duration, 0, 1))


def test_before_any_command_the_arm_stands_where_it_is():
    session = Session().wait(100)
    assert session.driver.is_connected
    assert session.robot.mode == MOVE
    np.testing.assert_array_equal(session.robot.q_d, READY)


@pytest.mark.parametrize("seed", range(2))
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
        assert session.follows, session.robot.reflex_reason
        worst = max(worst, np.abs(session.robot.q_d - path(t)).max())
    np.testing.assert_allclose(session.robot.q_d, READY + 0.35, atol=1e-4)
    assert worst < 0.012


def test_the_arm_follows_a_ramp_with_the_lag_of_the_filter():
    session = Session()
    rate = 0.1
    for k in range(400):
        t = 0.005 * k
        session.send(READY + rate * max(0.0, t - 0.5 * (1 - np.exp(-t / 0.5))))
    lag = (READY[0] + rate * (t - 0.5 * (1 - np.exp(-t / 0.5)))) - session.robot.q_d[0]
    # The pole that 1 / (2 pi 30 Hz) = 5.3 ms gives, seen 5 ms after the step of the held command.
    assert 0 < lag < rate * 0.0053
    assert session.robot.v_d[0] == pytest.approx(rate, rel=0.6)


@pytest.mark.parametrize("step", [0.002, 0.01, 0.1])
def test_a_step_from_rest_is_a_reflex_and_a_tiny_one_is_not(step):
    session = Session().send(READY).send(READY)
    assert session.send(READY + 1e-4).follows
    session.send(READY + 1e-4 + step)
    assert session.is_reflex
    assert session.robot.reflex_reason == "joint_motion_generator_velocity_discontinuity"
    assert np.abs(session.wait(200).robot.q_d - READY).max() < 2e-4  # nothing of the step was done


def test_a_first_command_far_from_the_present_position_is_a_reflex():
    assert Session().wait(50).send(READY + 0.01).is_reflex


def test_a_stop_from_one_command_to_the_next_is_a_reflex():
    path, session = swing(1.0, 0.35), Session()
    for k in range(100):
        session.send(path(0.005 * k))
    assert session.follows
    for _ in range(10):
        session.send(path(0.005 * 99))
    assert session.is_reflex


def test_smooth_but_too_fast_or_too_hard_is_a_reflex():
    for duration, amplitude, reason in (
        (1.5, WRIST * 2.4, "velocity_limits"),  # 3 rad/s, 6.2 rad/s^2
        (0.3, 0.3 * SHOULDER, "acceleration_discontinuity"),  # 1.9 rad/s, 19 rad/s^2
    ):
        path, session = swing(duration, amplitude), Session()
        for k in range(int(duration / 0.005)):
            session.send(path(0.005 * k))
        assert reason in session.robot.reflex_reason


def test_just_within_the_limits_is_no_reflex():
    duration = 1.2
    amplitude = 0.85 * duration * PANDA_LIMITS.velocity.min() / 1.875  # its peak speed is 85 % of the limit
    amplitude = min(amplitude, 0.8 * duration**2 * PANDA_LIMITS.acceleration.min() / 5.774)
    path, session = swing(duration, np.array([1, 0, 0, 0, 0, 0, 0]) * amplitude), Session()
    for k in range(260):
        session.send(path(0.005 * k))
    assert session.follows, session.robot.reflex_reason


def test_leaving_the_joint_range_is_a_reflex():
    session = Session()
    for k in range(2000):
        session.send(READY + WRIST * 3.5 * smooth(min(1.0, k / 1600)))
    assert session.robot.reflex_reason == "joint_motion_generator_position_limits_violation"
    assert PANDA_LIMITS.contains(session.wait(200).robot.q_d, margin=-0.01)  # it had to brake


def test_an_expired_position_holds_and_the_stream_may_go_on_from_there():
    path, session = swing(1.0, 0.35), Session()
    for k in range(60):
        session.send(path(0.005 * k))
    held = path(0.005 * 59)
    session.wait(700)
    np.testing.assert_allclose(session.robot.q_d, held, atol=1e-5)
    assert session.send(held).send(held).follows
    assert session.wait(300).send(held + 0.01).is_reflex


def test_what_a_driver_that_was_kept_from_running_has_missed_is_not_held_against_the_client():
    path, session = swing(1.0, 0.35), Session()
    for k in range(60):
        session.send(path(0.005 * k))
    session.now += 200_000  # its process slept, and heard nothing
    session.driver.miss()
    for k in range(100, 240):
        session.send(path(0.005 * k))
        assert session.follows, session.robot.reflex_reason
    assert session.send(READY).is_reflex  # it judges again


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
        return session.send(following(position) if mode == "position" else following(0.0))

    if mode == "position":
        assert paused(45, lambda q: q + 0.05 * 0.3).follows  # where it should be by now
        assert paused(45, lambda q: q).follows
        assert paused(80, lambda q: q).follows
        assert paused(10, lambda q: q).is_reflex  # a stop from full speed
        assert paused(80, lambda q: q - 0.02).is_reflex
    else:
        assert paused(45, lambda v: np.full(7, 0.3)).follows
        assert paused(80, lambda v: np.zeros(7)).follows
        assert paused(10, lambda v: np.zeros(7)).is_reflex
        assert paused(80, lambda v: np.full(7, -0.3)).is_reflex


def test_a_hold_at_speed_is_overshot_as_no_limiter_brakes_ahead_of_time():
    path, session = swing(1.0, 0.35), Session()
    for k in range(100):  # 0.66 rad/s
        session.send(path(0.005 * k))
    farthest = max(session.wait(1).robot.q_d[1] for _ in range(500)) - path(0.005 * 99)[1]
    # Braking with 7.5 rad/s^2 takes 29 mm of arc; 30 Hz and the held command leave 5 of them.
    assert 0.012 < farthest < 0.03
    session.wait(1500)
    np.testing.assert_allclose(session.robot.q_d, path(0.005 * 99), atol=1e-4)


@pytest.mark.parametrize(("age_ms", "moves"), [(95, True), (105, False), (-105, False)])
def test_a_command_expires_a_tenth_of_a_second_from_its_stamp_in_either_direction(age_ms, moves):
    session = Session("velocity")
    session.send(np.full(7, 0.05), stamp_error=-1000 * age_ms, ticks=2)
    assert (np.abs(session.robot.v_d).max() > 0) == moves


def test_velocity_is_held_until_it_expires_and_then_ends_within_the_acceleration_limit():
    session = Session("velocity")
    for k in range(100):
        session.send(np.full(7, 0.3 * smooth(min(1.0, k / 60))))
    np.testing.assert_allclose(session.robot.v_d, 0.3, atol=1e-3)
    before = session.robot.q_d
    session.wait(90)
    np.testing.assert_allclose(session.robot.q_d - before, 0.027, atol=1e-4)
    speeds = [session.wait(1).robot.v_d for _ in range(150)]
    np.testing.assert_allclose(speeds[-1], 0, atol=1e-6)
    assert (np.abs(np.diff(speeds, axis=0)) <= PANDA_LIMITS.acceleration * 1e-3 + 1e-12).all()
    assert session.follows


@pytest.mark.parametrize(
    ("values", "reason"),
    [(np.full(7, 0.5), "acceleration_discontinuity"), (np.full(7, 3.0), "velocity_limits")],
)
def test_a_jump_of_velocity_is_a_reflex(values, reason):
    session = Session("velocity").send(np.zeros(7)).send(values)
    assert session.is_reflex
    assert reason in session.robot.reflex_reason


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
    session = Session(mode).send(READY if mode == "position" else np.zeros(7), **changes)
    assert (session.driver.end.code, session.robot.mode) == (ENDED, IDLE)
    assert words in session.driver.end.reason


def test_a_wrong_mode_ends_the_driver_even_when_expired_but_a_wrong_size_does_not():
    assert Session().send(READY, stamp_error=-500_000, control_mode_expected=2).driver.end is not None
    assert Session().send(READY, stamp_error=-500_000, num_joint_position=6).follows


def in_motion(mode="position", **config):
    """A session in the middle of a swing, with 0.66 rad/s."""
    path, session = swing(1.0, 0.35), Session(mode, **config)
    for k in range(100):
        values = path(0.005 * k) if mode == "position" else (path(0.005 * k + 0.005) - path(0.005 * k)) / 0.005
        session.send(values)
    assert np.abs(session.robot.v_d).max() > 0.6
    return session


def reflex(session):
    session.robot.enter_reflex("cartesian_reflex")


def stop(session):
    session.robot.user_stop()


def kill(session):
    session.driver.kill()


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    ("event", "code", "left_in"), [(reflex, ENDED, IDLE), (stop, ABORTED, USER_STOPPED), (kill, KILLED, REFLEX)]
)
def test_the_driver_never_lives_to_tell_of_a_stop_and_the_arm_brakes_within_its_limits(
    mode, event, code, left_in
):
    session = in_motion(mode)
    event(session)
    motion, told = [], []
    for _ in range(300):
        motion.append((session.wait(1).robot.v_d, session.robot.a_d))
        told += [session.robot.mode] if session.driver.is_connected else []
    v, a = np.moveaxis(motion, 1, 0)
    assert (session.driver.end.code, session.robot.mode, set(told) - {MOVE}) == (code, left_in, set())
    limits = PANDA_LIMITS
    assert (np.abs(a) <= limits.acceleration).all()
    assert (np.abs(np.diff(a, axis=0)) <= 1e-3 * limits.jerk + 1e-9).all()
    # 0.66 rad/s at 7.5 rad/s^2 in the shoulder, which takes 2 ms to get there.
    assert np.flatnonzero(np.abs(v).max(axis=1) > 1e-6)[-1] == pytest.approx(90, abs=6)


@pytest.mark.parametrize("event", [reflex, stop, kill])
def test_a_dead_driver_neither_hears_nor_comes_back_by_itself(event):
    session = in_motion()
    event(session)
    session.wait(5000)
    stopped = session.robot.q_d
    for _ in range(100):
        session.send(stopped + 0.1)
    assert not session.driver.is_connected
    np.testing.assert_array_equal(session.robot.q_d, stopped)


def test_a_driver_that_is_started_connects_for_a_while_and_then_holds_the_arm_where_it_is():
    session = in_motion()
    reflex(session)
    session.wait(500)
    session.robot.guide(session.robot.q_d + 0.3 * SHOULDER)
    session.wait(3000)
    assert session.driver.start(session.now)
    assert not session.driver.start(session.now)
    session.wait(999)
    assert (session.driver.is_connected, session.robot.mode) == (False, IDLE)
    there = session.wait(1).robot.q_d
    assert (session.driver.is_connected, session.robot.mode) == (True, MOVE)
    np.testing.assert_array_equal(session.wait(1000).robot.q_d, there)
    assert session.send(there).send(there).follows


def test_a_driver_that_is_started_while_the_robot_is_stopped_ends_again():
    session = in_motion()
    kill(session)
    assert session.wait(300).start().is_reflex  # it has told the robot to recover: the next one stays
    assert session.start().follows
    stop(session)
    assert session.wait(300).start().driver.end.code == ABORTED
    session.robot.recover()
    assert session.start().follows


def test_a_driver_that_is_killed_while_it_connects_is_gone():
    session = in_motion()
    reflex(session)
    session.wait(300).driver.start(session.now)
    kill(session.wait(500))
    assert session.wait(1000).driver.end.code == KILLED
    assert session.robot.mode == IDLE


def test_a_person_leads_the_arm_slowly_to_where_it_is_wanted_and_nobody_takes_it_from_a_driver():
    session = in_motion()
    with pytest.raises(ValueError, match="controlled"):
        session.robot.guide(READY)
    stop(session)
    goal = session.wait(500).robot.q_d + 0.3 * WRIST
    session.robot.guide(goal)
    speeds = [session.wait(1).robot.v_d for _ in range(500)]
    assert session.robot.mode == GUIDING
    assert np.abs(speeds).max() == pytest.approx(HAND_SPEED, rel=1e-3)
    session.wait(2500)
    assert session.robot.mode == USER_STOPPED
    np.testing.assert_allclose(session.robot.q_d, goal, atol=2e-4)
    with pytest.raises(ValueError, match="cannot go there"):
        session.robot.guide(READY + 9)


def test_a_driver_that_survives_stops_tells_of_them_and_goes_on_when_the_robot_has_recovered():
    for event, mode in ((reflex, REFLEX), (stop, USER_STOPPED)):
        session = in_motion(survives_stops=True)
        event(session)
        session.wait(300)
        assert (session.driver.is_connected, session.robot.mode) == (True, mode)
        stopped = session.robot.q_d
        session.send(stopped)
        session.robot.recover()
        session.wait(10)
        assert session.send(stopped).send(stopped).follows
        np.testing.assert_array_equal(session.robot.q_d, stopped)


def test_a_driver_of_status_only_listens_to_nothing_and_tells_of_everything():
    session = Session("status_only")
    session.driver.receive(command("position", READY + 1, session.now, control_mode_expected=7))
    assert session.wait(10).robot.mode == IDLE
    for event, mode in ((reflex, REFLEX), (stop, USER_STOPPED)):
        event(session)
        assert (session.wait(10).driver.is_connected, session.robot.mode) == (True, mode)
        session.robot.recover()
    session.robot.guide(READY + 0.1)
    assert session.wait(10).robot.mode == GUIDING
    assert session.wait(2000).robot.mode == IDLE
    np.testing.assert_allclose(session.robot.q_d, READY + 0.1, atol=2e-4)
