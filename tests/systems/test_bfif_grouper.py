"""BFIFGrouper through its ports."""

import numpy as np
import pytest
from pydrake.common.value import Value

from riseg_drake.segmentation.bfif import BFIFParameters
from riseg_drake.segmentation.effective_flow import MovingParameters
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.systems.bfif_grouper import BFIFGrouper
from tests.systems.ports import port_names


def grouped(payloads, parameters: BFIFParameters | None = None, seed: int = 0):
    grouper = BFIFGrouper(parameters, seed)
    context = grouper.CreateDefaultContext()
    for name, value in (
        ("pair", payloads.pair),
        ("expected_flow", payloads.expected_flow),
        ("optical_flow", payloads.optical_flow),
        ("above_table", payloads.above_0),
    ):
        grouper.GetInputPort(name).FixValue(context, Value[object](value))
    return grouper.GetOutputPort("groups").Eval(context), grouper.GetOutputPort("flow_span").Eval(context)


def test_ports_have_the_names_of_the_contract() -> None:
    inputs, outputs = port_names(BFIFGrouper())
    assert inputs == ["pair", "expected_flow", "optical_flow", "above_table"]
    assert outputs == ["groups", "flow_span"]


def test_it_finds_the_groups_that_the_function_finds(payloads) -> None:
    groups, flow_span = grouped(payloads)
    assert isinstance(groups, BFIFGroups)
    np.testing.assert_array_equal(groups.motion_C0, payloads.groups.motion_C0)
    np.testing.assert_array_equal(groups.group, payloads.groups.group)
    assert flow_span == pytest.approx([payloads.groups.flow_span])
    assert flow_span[0] > 1


def test_body_frames_depend_on_the_seed_and_on_nothing_else(payloads) -> None:
    one, again, other = (grouped(payloads, seed=seed)[0].pixel for seed in (5, 5, 6))
    np.testing.assert_array_equal(one, again)
    assert one.shape != other.shape or (one != other).any()


def test_its_parameters_are_those_given(payloads) -> None:
    groups, flow_span = grouped(payloads, BFIFParameters(moving=MovingParameters(flow_min=100.0)))
    assert len(groups) == 0
    assert flow_span == pytest.approx([0.0])
