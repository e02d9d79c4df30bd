"""Ports for Python classes: what is wrong is named where it comes in."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem

from riseg_drake.geometry.rgbd import NO_PAIR, FramePair
from riseg_drake.pushing.table_map import SeenTable
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE
from riseg_drake.systems.expected_flow import ExpectedFlow
from riseg_drake.systems.value_input import ValueInput


class Listener(LeafSystem):
    def __init__(self) -> None:
        super().__init__()
        self.set_name("Listener")
        self.heard = ValueInput(self, "heard", NO_PAIR)

    def after(self, value: object) -> tuple[ValueInput[FramePair], Context]:
        context = self.CreateDefaultContext()
        self.GetInputPort("heard").FixValue(context, AbstractValue.Make(value))
        return self.heard, context


def test_a_value_of_the_class_comes_out_as_it_went_in() -> None:
    class Another(FramePair):
        """A pair, too."""

    for pair in (NO_PAIR, replace(NO_PAIR, residual=0.5), Another(NO_PAIR.reference, NO_PAIR.current)):
        heard, context = Listener().after(pair)
        assert heard.Eval(context) is pair


@pytest.mark.parametrize("value", [np.zeros((2, 2)), (1, 2), {"pair": 1}])
def test_one_of_another_class_is_refused_with_the_names_of_system_port_and_both_classes(value: object) -> None:
    heard, context = Listener().after(value)
    with pytest.raises(
        TypeError, match=rf"heard of Listener takes .*rgbd\.FramePair, not {type(value).__name__}"
    ):
        heard.Eval(context)


def test_whether_it_is_connected_can_be_asked() -> None:
    listener = Listener()
    assert not listener.heard.HasValue(listener.CreateDefaultContext())
    heard, context = listener.after(NO_PAIR)
    assert heard.HasValue(context)


def test_a_stage_names_what_came_in_wrong() -> None:
    stage = ExpectedFlow()
    context = stage.CreateDefaultContext()
    stage.get_input_port().FixValue(context, AbstractValue.Make(np.zeros(3)))
    with pytest.raises(TypeError, match=r"input port pair of ExpectedFlow takes .*FramePair, not ndarray"):
        stage.get_output_port().Eval(context)


def test_what_has_the_names_of_a_protocol_is_taken_and_what_lacks_one_is_not() -> None:
    class Seen:
        mask = height = plane_W = np.zeros(4)

    class WithoutTable:
        mask = height = np.zeros(4)

    class Planner(LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.above = ValueInput(self, "above", NOTHING_ABOVE_TABLE, SeenTable)

    planner = Planner()
    context = planner.CreateDefaultContext()
    for value in (Seen(), NOTHING_ABOVE_TABLE):
        planner.get_input_port().FixValue(context, AbstractValue.Make(value))
        assert isinstance(planner.above.Eval(context), type(value))
    planner.get_input_port().FixValue(context, AbstractValue.Make(WithoutTable()))
    with pytest.raises(TypeError, match=r"SeenTable, not .*WithoutTable"):
        planner.above.Eval(context)
