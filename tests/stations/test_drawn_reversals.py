"""What moved as one and then apart is two, in given poses before the simulated camera; a few of many cases."""

import pytest

from riseg_drake.stations.object_models import find_models
from tests.stations.drawn_reversals import FOLDERS, merged

pytestmark = pytest.mark.renders


def test_two_that_went_as_one_and_left_the_keyframe_while_they_parted_are_two() -> None:
    # Much of where they are in the end the keyframe does not show: they are looked for before it is given up.
    assert [two for _, two in merged(170, find_models(FOLDERS))] == [True]
