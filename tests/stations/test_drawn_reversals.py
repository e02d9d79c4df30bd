"""What moved as one and then apart is two, in given poses before the simulated camera; a few of many cases."""

import pytest

from riseg_drake.segmentation.algorithm import SegmentObjsParameters
from riseg_drake.stations.object_models import find_models
from tests.stations.drawn_reversals import FOLDERS, merged

pytestmark = pytest.mark.renders


def test_two_that_went_as_one_are_two_when_each_has_gone_for_itself() -> None:
    # By colour they would be two from the first push on.
    parameters = SegmentObjsParameters()
    parameters.segment.evidence.belief.prior.color = 0.0
    assert [two for _, two in merged(170, find_models(FOLDERS), parameters)] == [True]
