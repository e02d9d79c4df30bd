"""Why there is no push, in words."""

import pytest

from riseg_drake.pushing.decision import UNDECIDED, Criterion, Decision, Ending, PathStage
from riseg_drake.pushing.push import NO_PUSH


def test_before_the_first_frame_and_with_a_push_there_is_nothing_to_say():
    assert UNDECIDED.why == ""
    assert Decision(NO_PUSH, None, 0.01).why == ""


def test_nothing_left_says_so():
    assert Decision(ending=Ending.NOTHING_LEFT, unsettled_area=0.0).why == "nothing is left to find"


@pytest.mark.parametrize(
    ("unsettled", "doubtful", "says"),
    [
        (0.0123, 0.0, "123 cm^2 are left to find"),
        (0.0123, 0.0023, "100 cm^2 are left to find, 23 cm^2 are in doubt"),
        (0.0023, 0.0023, "23 cm^2 are in doubt"),
        (0.0, 0.0, "0 cm^2 are left to find"),
    ],
)
def test_what_remains_is_told_apart_from_what_is_in_doubt(unsettled, doubtful, says):
    assert Decision(NO_PUSH, Ending.ENOUGH_INTERACTIONS, unsettled, doubtful).why == says


def test_the_criterion_that_most_candidates_fail_is_named_with_how_many():
    failed = {Criterion.ACCESSIBLE: 3, Criterion.MOVES_ALONE: 7, Criterion.HIGH_ENOUGH: 5}
    decision = Decision(NO_PUSH, Ending.NOTHING_VALID, 0.005, 0.0, 9, failed)
    assert decision.fails_most is Criterion.MOVES_ALONE
    assert decision.why == f"no push is valid, 50 cm^2 are left to find: {Criterion.MOVES_ALONE.value} (7 of 9)"


def test_without_a_candidate_nothing_borders_on_free_table():
    decision = Decision(NO_PUSH, Ending.NOTHING_VALID, 0.005)
    assert decision.fails_most is None
    assert decision.why == "no push is valid, 50 cm^2 are left to find: none of it borders on free table"


def test_without_a_path_the_stage_is_named():
    decision = Decision(NO_PUSH, Ending.NO_PATH, 0.005, 0.0, 4, {PathStage.STROKE: 4})
    says = (
        f"the arm has no path for any valid push, 50 cm^2 are left to find: {PathStage.STROKE.value} (4 of 4)"
    )
    assert decision.why == says
