from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.robot.supervisor import (
    MOVE,
    REFLEX,
    USER_STOPPED,
    Cause,
    Mode,
    Observation,
    SafetyParameters,
    SafetyState,
    ended,
    released,
    supervise,
)
from tests.docs.pages import CHECKOUT, section, table_rows

GOOD = Observation(
    now=10.0,
    status_time=9.99,
    status_gap=0.005,
    robot_mode=MOVE,
    image_time=9.9,
    in_motion=True,
    contact_planned=False,
    tip_force=2.0,
    p_WE=np.array([0.5, 0.0, 0.1]),
    held_back=False,
    lag=0.01,
    gap=0.0,
)
FOLLOWING = SafetyState(Mode.FOLLOWING)
PARAMETERS = SafetyParameters()


def after(state=FOLLOWING, **seen):
    return supervise(state, replace(GOOD, **seen), PARAMETERS)


def test_nothing_moves_before_the_arm_has_told_where_it_is():
    state = after(SafetyState(), status_time=None)
    assert state.mode is Mode.WAITING
    assert not state.may_move
    assert after(state).may_move


@pytest.mark.parametrize(
    ("seen", "cause"),
    [
        ({"robot_mode": 1}, Cause.NOT_READY),
        ({"robot_mode": USER_STOPPED}, Cause.USER_STOP),
        ({"status_time": 9.0}, Cause.STATUS_OLD),
    ],
)
def test_an_arm_that_is_not_ready_at_first_needs_the_operators_word_when_it_is(seen, cause):
    state = after(SafetyState(), **seen)
    assert state == SafetyState(Mode.STOPPED, cause)
    assert not after(state).may_move
    assert after(released(state)).may_move


def test_all_is_well_goes_on():
    assert after() == FOLLOWING


LATCHED = [
    ({"robot_mode": REFLEX}, Cause.REFLEX),
    ({"robot_mode": USER_STOPPED}, Cause.USER_STOP),
    ({"robot_mode": 1}, Cause.NOT_READY),
    ({"status_gap": 0.11}, Cause.STATUS_ENDED),
    ({"status_gap": np.inf}, Cause.STATUS_ENDED),
    ({"tip_force": 15.1}, Cause.FORCE),
    ({"held_back": True}, Cause.JOINT_LIMIT),
    ({"p_WE": np.array([0.5, 0.0, -0.001])}, Cause.WORKSPACE),
    ({"p_WE": np.array([0.5, 0.7, 0.1])}, Cause.WORKSPACE),
    ({"lag": 0.11}, Cause.NOT_FOLLOWING),
    ({"gap": 0.11}, Cause.GAP),
]
NO_NUMBER = [
    ({"tip_force": np.nan}, Cause.FORCE),
    ({"p_WE": np.array([0.5, np.nan, 0.1])}, Cause.WORKSPACE),
    ({"lag": np.nan}, Cause.NOT_FOLLOWING),
    ({"gap": np.nan}, Cause.GAP),
    ({"status_gap": np.nan}, Cause.STATUS_ENDED),
    ({"status_time": np.nan}, Cause.STATUS_OLD),
    ({"image_time": np.nan}, Cause.IMAGES_OLD),
    ({"now": np.nan}, Cause.STATUS_OLD),
]


@pytest.mark.parametrize(("seen", "cause"), LATCHED)
def test_a_stop_holds_until_the_operator_says_otherwise(seen, cause):
    state = after(**seen)
    assert state == SafetyState(Mode.STOPPED, cause)
    for _ in range(10):
        state = after(state)  # all is well again
    assert state.mode is Mode.STOPPED
    assert after(released(state)).may_move


@pytest.mark.parametrize(("seen", "cause"), NO_NUMBER)
def test_what_is_no_number_is_a_danger(seen, cause):
    state = after(**seen)
    assert not state.may_move
    assert state.cause is cause


@pytest.mark.parametrize(
    ("begun", "now", "may_move"),
    [
        (-0.005, -0.005, True),
        (-0.005, -0.006, False),
        (-0.02, -0.009, True),
        (-0.02, -0.011, False),
        (0.1, -0.001, False),
        (np.nan, 0.1, False),
    ],
)
def test_from_a_little_outside_the_workspace_the_tip_may_come_back_but_go_no_further(begun, now, may_move):
    for axis, end, outwards in ((2, 0.0, 1), (1, 0.6, -1)):
        tips = np.full((2, 3), GOOD.p_WE)
        tips[:, axis] = end + outwards * np.array([begun, now])
        assert after(p_WE_begun=tips[0], p_WE=tips[1]).may_move is may_move


@pytest.mark.parametrize("news", ["status_time", "image_time"])
def test_news_of_a_time_to_come_is_no_news(news):
    assert not after(**{news: 20.0}).may_move


def test_what_an_old_status_said_is_no_danger_but_a_pause():
    state = after(status_time=9.0, tip_force=50.0, lag=0.5)
    assert state == SafetyState(Mode.PAUSED, Cause.STATUS_OLD)


@pytest.mark.parametrize("state", [FOLLOWING, SafetyState(Mode.PAUSED, Cause.STATUS_OLD)])
def test_a_status_that_had_ended_waits_for_the_operator_whatever_the_arm_did(state):
    stopped = after(state, status_gap=0.5)
    assert stopped == SafetyState(Mode.STOPPED, Cause.STATUS_ENDED)
    assert after(stopped) == stopped


def test_after_a_pause_an_arm_that_is_elsewhere_stays_there():
    state = SafetyState(Mode.PAUSED, Cause.STATUS_OLD, fresh_since=9.6)
    assert after(state, lag=0.009).may_move
    assert after(state, lag=0.011) == SafetyState(Mode.STOPPED, Cause.MOVED)


@pytest.mark.parametrize(("seen", "cause"), LATCHED[:3])
def test_the_word_alone_does_not_move_an_arm_that_refuses(seen, cause):
    assert not after(released(after(**seen)), **seen).may_move


@pytest.mark.parametrize(
    ("seen", "cause"),
    [({"status_time": 9.89}, Cause.STATUS_OLD), ({"image_time": 9.49}, Cause.IMAGES_OLD)],
)
def test_old_news_is_a_pause_that_ends_when_news_has_been_fresh_for_a_while(seen, cause):
    state = after(**seen)
    assert state == SafetyState(Mode.PAUSED, cause)
    for now in (10.1, 10.2):
        state = after(state, now=now, status_time=now, image_time=now)
        assert not state.may_move
    assert after(state, now=10.41, status_time=10.41, image_time=10.41).may_move


def test_news_that_is_fresh_only_now_and_then_does_not_end_a_pause():
    state = after(status_time=9.0)
    for tick in range(10):
        now = 10 + 0.2 * tick
        state = after(state, now=now, status_time=now, image_time=now)
        state = after(state, now=now + 0.1, status_time=now - 1, image_time=now)
        assert not state.may_move


def test_pictures_may_be_old_while_no_motion_is_planned():
    assert after(image_time=None, in_motion=False).may_move
    assert not after(image_time=None).may_move


def test_a_push_may_push_back_harder():
    assert after(tip_force=29.0, contact_planned=True).may_move
    assert after(tip_force=31.0, contact_planned=True).cause is Cause.FORCE


def test_a_danger_in_a_pause_is_a_stop():
    assert after(SafetyState(Mode.PAUSED, Cause.IMAGES_OLD), tip_force=50.0).mode is Mode.STOPPED


def test_what_the_arm_says_is_the_cause_that_is_told():
    stopped = SafetyState(Mode.STOPPED, Cause.FORCE)
    assert after(stopped, robot_mode=REFLEX).cause is Cause.REFLEX


def test_the_end_is_the_end():
    state = ended(Cause.INTERRUPT)
    assert after(state) == state
    assert released(state) == state


def test_the_page_has_a_row_for_each_state():
    rows = table_rows(section(CHECKOUT / "docs" / "hardware.md", "What stops it"))
    assert [row[0] for row in rows[: len(Mode)]] == [mode.name.lower() for mode in Mode]
