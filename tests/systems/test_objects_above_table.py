"""ObjectsAboveTable through its ports."""

import numpy as np

from riseg_drake.geometry.rgbd import NO_FRAME
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE, AboveTable, AboveTableParameters
from riseg_drake.systems.objects_above_table import ObjectsAboveTable
from tests.systems.ports import evaluate, port_names


def test_ports_have_the_names_of_the_contract() -> None:
    assert port_names(ObjectsAboveTable()) == (["frame"], ["above_table"])


def test_it_says_what_stands_on_the_table_of_a_frame(payloads) -> None:
    above = evaluate(ObjectsAboveTable(), "above_table", frame=payloads.pair.reference)
    assert isinstance(above, AboveTable)
    np.testing.assert_array_equal(above.mask, payloads.above_0.mask)
    np.testing.assert_array_equal(above.plane_W, payloads.above_0.plane_W)


def test_its_parameters_are_those_given(payloads) -> None:
    parameters = AboveTableParameters(height_min=0.04)
    above = evaluate(ObjectsAboveTable(parameters), "above_table", frame=payloads.pair.reference)
    assert 0 < np.count_nonzero(above.mask) < np.count_nonzero(payloads.above_0.mask)


def test_without_a_frame_there_is_nothing_to_say() -> None:
    assert evaluate(ObjectsAboveTable(), "above_table", frame=NO_FRAME) is NOTHING_ABOVE_TABLE
