"""The arm never moves unasked: the driver ends in every phase, and a hand moves the arm before it is back."""

import numpy as np
import pytest

from riseg_drake.robot.command_limiter import LONGEST_STOP
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.supervisor import REFLEX, USER_STOPPED, Cause, Mode, SafetyState
from riseg_drake.robot.velocity_drift import VelocityDrift
from tests.robot.lab import PERIOD, Lab

THERE = READY + 0.5 * np.array([1, -1, 1, 1, -1, 1, 1])
BY_HAND = 0.3 * np.array([1, 0.5, -1, 0.5, 1, -0.5, 1])  # rad
MODES = ["velocity", "position"]


def moving(lab):
    lab.go(THERE)
    lab.run(1.6)
    assert np.max(lab.speeds[-1]) > 0.2


def pushing(lab):
    lab.stream.expect_contact(lab.now, lab.now + 10)
    moving(lab)


def holding(lab):
    lab.go(READY)
    lab.run(1.0)


def paused(lab):
    moving(lab)
    lab.delay_images()
    lab.run(0.5)
    assert lab.stream.state.mode is Mode.PAUSED
    assert lab.stream.at_rest
    lab.show_images()


def stopped(lab):
    moving(lab)
    lab.push_against(20.0)
    lab.run(0.5)
    assert lab.stream.state.cause is Cause.FORCE
    lab.push_against(0.0)


def killed(lab):
    lab.die()


def reflex(lab, mode=REFLEX):
    """As a driver that publishes it says it, for a moment."""
    lab.robot_mode = mode
    lab.run(0.02)
    lab.die()


def user_stop(lab):
    reflex(lab, USER_STOPPED)


ENDS = {moving: killed, pushing: reflex, holding: user_stop, paused: killed, stopped: reflex}
"""Of each phase, one that the fast tests take; the others stand behind the mark."""
CASES = [
    pytest.param(mode, phase, end, marks=[] if (mode, end) == ("velocity", one) else pytest.mark.renders)
    for mode in MODES
    for phase, one in ENDS.items()
    for end in (killed, reflex, user_stop)
]


def dead(mode, phase, end, turn=BY_HAND):
    """A lab whose driver has ended, with the arm moved by hand; what was sent meanwhile was checked."""
    lab = Lab(mode, noise=1e-4)
    phase(lab)
    end(lab)
    # Old status is noticed after 0.1 s, then the arm brakes.
    lab.run(0.1 + LONGEST_STOP + 2 * PERIOD)
    assert lab.stream.at_rest
    lab.forget()
    lab.guide(turn)
    lab.run(0.4)
    assert not lab.sent()
    return lab


@pytest.mark.parametrize(("mode", "phase", "end"), CASES)
def test_a_driver_that_is_started_anew_hears_nothing_and_the_arm_stays_where_the_hand_left_it(mode, phase, end):
    lab = dead(mode, phase, end)
    lab.start_anew()
    lab.forget()
    lab.run(1.0)
    assert np.max(lab.speeds) <= 0.01
    assert not lab.sent()
    assert lab.stream.state.mode is Mode.STOPPED


@pytest.mark.parametrize(("mode", "phase", "end"), CASES)
def test_at_the_operators_word_it_sets_out_from_where_the_arm_is_on_a_way_that_begins_there(mode, phase, end):
    lab = dead(mode, phase, end)
    lab.start_anew()
    lab.run(0.1)
    assert lab.stream.off_path > 0.02
    here = lab.status.position
    lab.stream.abandon_path()
    lab.stream.release()
    lab.forget()
    lab.run(0.2)  # targets of the old path still come
    assert_first_command_is_where_the_arm_is(lab)
    assert np.abs(lab.q - here).max() < 1e-3
    lab.stream.begin_path()
    duration = lab.go(READY, q_from=here)
    lab.run(duration + 1.6 if phase is moving else 1.5)
    assert phase is not moving or np.abs(lab.q - READY).max() < 2e-3
    assert np.abs(lab.q - here).max() > 0.01  # it goes on
    assert (np.array(lab.speeds) <= 0.35 * lab.robot.velocity).all()


@pytest.mark.parametrize(
    "phase", [moving, *(pytest.param(p, marks=pytest.mark.renders) for p in (pushing, paused, stopped))]
)
@pytest.mark.parametrize("mode", MODES)
def test_an_arm_that_is_still_near_its_path_goes_on_with_it_at_the_operators_word(mode, phase):
    lab = dead(mode, phase, killed, turn=0.01)
    lab.start_anew()
    lab.run(0.5)
    assert lab.stream.off_path <= 0.02
    lab.stream.release()
    lab.run(0.02)
    assert_first_command_is_where_the_arm_is(lab)
    lab.run(lab.path.end_time())
    assert np.abs(lab.q - THERE).max() < 2e-3


def assert_first_command_is_where_the_arm_is(lab):
    first = next(k for k, command in enumerate(lab.commands) if command is not None)
    if lab.mode == "velocity":
        np.testing.assert_array_equal(lab.commands[first], np.zeros(7))
        assert np.abs(lab.stream._limiter.position - lab.q).max() < 0.01
    else:
        assert np.abs(lab.commands[first] - lab.measured[first]).max() <= 1e-3


@pytest.mark.parametrize("mode", MODES)
def test_the_word_alone_does_not_make_it_go_on_with_a_path_that_is_far_away(mode):
    lab = dead(mode, moving, killed)
    lab.start_anew()
    lab.run(0.5)
    lab.stream.release()
    lab.forget()
    lab.run(1.0)
    assert lab.stream.state.cause is Cause.GAP
    assert not lab.sent()
    assert np.max(lab.speeds) == 0


@pytest.mark.parametrize("mode", MODES)
def test_a_word_to_a_driver_that_is_still_dead_changes_nothing(mode):
    lab = dead(mode, stopped, killed, turn=0.0)
    lab.stream.release()
    lab.run(0.5)
    assert lab.stream.state.mode is Mode.STOPPED
    assert lab.stream.state.cause is Cause.STATUS_OLD
    lab.start_anew()
    lab.run(2.0)
    assert not lab.sent()


@pytest.mark.parametrize(("gap", "goes_on"), [(0.02, True), (0.09, True), (0.11, False), (0.5, False)])
@pytest.mark.parametrize("mode", MODES)
def test_a_status_that_was_late_is_a_pause_and_one_that_had_ended_a_stop(mode, gap, goes_on):
    lab = Lab(mode)
    moving(lab)
    lab.delay_status(0.6, gap)
    lab.run(0.55)
    assert lab.stream.state == SafetyState(Mode.PAUSED, Cause.STATUS_OLD)
    lab.run(0.5)
    assert lab.stream.state.may_move is goes_on
    if not goes_on:
        assert lab.stream.state.cause is Cause.STATUS_ENDED


@pytest.mark.parametrize("mode", MODES)
def test_an_arm_that_is_found_elsewhere_after_a_silence_does_not_go_back_by_itself(mode):
    lab = Lab(mode)
    holding(lab)
    lab.die()
    lab.run(0.6)
    lab.guide(0.02)
    lab.last_stamp = lab.now  # whoever hears all statuses saw no gap in their stamps
    lab.start_anew()
    lab.forget()
    lab.run(1.0)
    assert lab.stream.state.cause is Cause.MOVED
    assert not lab.sent()


def test_an_arm_that_is_far_away_when_its_status_comes_again_hears_not_even_a_stop():
    lab = Lab("position")
    moving(lab)
    lab.q = lab.q + BY_HAND
    lab.delay_status(0, gap=0.6)  # unseen, since this process was kept from running
    lab.step()
    lab.forget()
    lab.run(1.0)
    assert lab.stream.state.cause is Cause.STATUS_ENDED
    assert not lab.sent()


def paused_in_motion(drifted, joint=0):
    """An arm in velocity mode that came off its commands by `drifted` rad on its way, pictures having ended.

    Its way is one of joint 0.
    """
    lab = Lab("velocity")
    lab.go(READY + np.array([0.8, 0, 0, 0, 0, 0, 0]))
    lab.run(1.2)
    assert lab.speeds[-1].max() > VelocityDrift.SLOW
    lab.q[joint] += drifted
    lab.delay_images()
    lab.run(0.5)
    assert lab.stream.state == SafetyState(Mode.PAUSED, Cause.IMAGES_OLD)
    return lab


def test_in_velocity_mode_drift_on_the_way_is_no_reason_to_stop_after_a_pause():
    lab = paused_in_motion(0.018)
    lab.show_images()
    lab.run(6.0)
    assert lab.stream.state.mode is Mode.FOLLOWING
    assert np.abs(lab.q - lab.path.value(lab.path.end_time())[:, 0]).max() < 0.002


def test_but_off_its_path_it_does_not_go_back_to_that_by_itself():
    lab = paused_in_motion(0.025, joint=1)
    lab.show_images()
    lab.run(1.0)
    assert lab.stream.state == SafetyState(Mode.STOPPED, Cause.GAP)


@pytest.mark.parametrize(("missing", "goes_on"), [(0.1, True), (-0.1, True), (0.2, False)])
def test_in_velocity_mode_a_silence_explains_what_was_commanded_in_it_and_no_more(missing, goes_on):
    lab = Lab("velocity")
    lab.go(READY + np.array([0.8, 0, 0, 0, 0, 0, 0]))
    lab.run(1.2)
    moved = lab.speeds[-1][0] * missing  # s of it; the silence is noticed after 0.1 s, and then the arm brakes
    moved += np.copysign(0.0095, missing)
    lab.delay_status(0.5, 0.02)
    lab.run(0.4)
    lab.q = lab.q - np.array([moved, 0, 0, 0, 0, 0, 0])  # by velocities that came too late
    lab.run(0.6)
    if not goes_on:
        assert lab.stream.state == SafetyState(Mode.STOPPED, Cause.MOVED)
        return
    assert lab.stream.state.may_move
    lab.run(6.0)
    assert np.abs(lab.q - lab.path.value(lab.path.end_time())[:, 0]).max() < 0.002


@pytest.mark.parametrize("pictures_end_first", [True, False])
@pytest.mark.parametrize("mode", MODES)
def test_pictures_that_are_late_too_do_not_explain_where_an_arm_is_after_a_silence(mode, pictures_end_first):
    lab = Lab(mode)
    lab.go(READY + np.array([0.8, 0, 0, 0, 0, 0, 0]))
    lab.run(1.2)
    if pictures_end_first:
        lab.delay_images()
        lab.run(0.5)
    lab.delay_status(0.8, 0.02)
    lab.run(0.3)
    assert lab.stream.state == SafetyState(Mode.PAUSED, Cause.STATUS_OLD)
    lab.delay_images()
    lab.run(0.2)
    lab.q = lab.q + np.array([0, 0.03, 0, 0, 0, 0, 0])
    lab.command = (-np.inf, None)  # and there it is held
    lab.run(0.8)
    assert lab.stream.state == SafetyState(Mode.PAUSED, Cause.IMAGES_OLD)
    lab.show_images()
    lab.forget()
    lab.run(1.0)
    assert lab.stream.state == SafetyState(Mode.STOPPED, Cause.MOVED)
    assert not np.max(lab.speeds)


def test_but_an_arm_that_was_moved_while_it_stood_stops():
    lab = paused_in_motion(0.018)
    lab.q = lab.q + 0.012
    lab.run(0.05)
    lab.show_images()
    lab.run(1.0)
    assert lab.stream.state == SafetyState(Mode.STOPPED, Cause.MOVED)
