"""MaskPropagator: the one state of Alg. 2, renewed once a frame."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from riseg_drake.geometry.rgbd import NO_PAIR, FramePair
from riseg_drake.segmentation.bfif import BFIFParameters, no_groups
from riseg_drake.segmentation.segment import SegmentParameters, segment
from riseg_drake.segmentation.segmentation import Segmentation, nothing_segmented
from riseg_drake.systems import mask_propagator
from riseg_drake.systems.mask_propagator import MaskPropagator
from tests.segmentation.drawn_scene import CAMERA
from tests.systems.ports import port_names

PERIOD, OFFSET = 0.1, 0.002


@pytest.fixture
def calls(monkeypatch) -> list[int]:
    """The frames for which `segment` was called."""
    made = []

    def counted(before, pair, *others):
        made.append(pair.current.sequence)
        return segment(before, pair, *others)

    monkeypatch.setattr(mask_propagator, "segment", counted)
    return made


class Alone:
    """A propagator whose inputs are fixed by hand, simulated."""

    def __init__(self, payloads, parameters: SegmentParameters | None = None) -> None:
        self.system = MaskPropagator(CAMERA, PERIOD, OFFSET, parameters)
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        self.show(
            pair=payloads.pair,
            expected_flow=payloads.expected_flow,
            optical_flow=payloads.optical_flow,
            groups=payloads.groups,
            above_table_reference=payloads.above_0,
            above_table=payloads.above_1,
        )

    def show(self, **inputs) -> None:
        for name, value in inputs.items():
            self.system.GetInputPort(name).FixValue(self.context, Value[object](value))

    def at(self, time: float) -> np.ndarray:
        self.simulator.AdvanceTo(time)
        return self.system.GetOutputPort("mask").Eval(self.context)

    @property
    def segmentation(self) -> Segmentation:
        return self.system.GetOutputPort("segmentation").Eval(self.context)


def test_ports_have_the_names_of_the_contract() -> None:
    inputs, outputs = port_names(MaskPropagator(CAMERA, PERIOD, OFFSET))
    assert inputs == [
        "pair",
        "expected_flow",
        "optical_flow",
        "groups",
        "above_table_reference",
        "above_table",
        "whole_above_table",
    ]
    assert outputs == ["mask", "settled_mask", "decided", "untouched", "segmentation"]


def test_at_first_the_mask_is_empty(payloads, calls) -> None:
    mask = Alone(payloads).at(OFFSET / 2)
    assert mask.shape == CAMERA.shape
    assert mask.dtype == np.uint16
    assert not mask.any()
    assert calls == []


def test_the_mask_is_what_the_function_makes_of_the_inputs(payloads) -> None:
    alone, expected = Alone(payloads), nothing_segmented(CAMERA.shape)
    first = FramePair(payloads.pair.reference, payloads.pair.reference)
    for number, (pair, groups) in enumerate([(first, no_groups()), (payloads.pair, payloads.groups)]):
        alone.show(pair=pair, groups=groups)
        mask = alone.at(number * PERIOD + OFFSET + 1e-4)
        expected = segment(
            expected,
            pair,
            payloads.expected_flow,
            payloads.optical_flow,
            groups,
            payloads.above_0,
            payloads.above_1,
            lambda: payloads.above_1,
            SegmentParameters(),
            BFIFParameters(),
        )
        np.testing.assert_array_equal(mask, expected.mask)
    assert mask.any()
    assert isinstance(alone.segmentation, Segmentation)
    assert alone.segmentation.object_ids == expected.object_ids
    assert alone.segmentation.sequence == payloads.pair.current.sequence


def test_a_pair_is_taken_in_once_however_long_it_stays(payloads, calls) -> None:
    alone = Alone(payloads)
    first = alone.at(OFFSET + 1e-4)
    np.testing.assert_array_equal(alone.at(7.5 * PERIOD), first)
    assert calls == [payloads.pair.current.sequence]


def test_each_new_pair_is_taken_in_at_the_next_tick(payloads, drawn_frames, calls) -> None:
    alone = Alone(payloads)
    alone.at(0.5 * PERIOD)
    alone.show(pair=FramePair(payloads.pair.reference, drawn_frames[3]))
    alone.at(PERIOD + OFFSET / 2)
    assert calls == [2]
    alone.at(PERIOD + OFFSET + 1e-4)
    assert calls == [2, 3]
    assert alone.segmentation.sequence == 3


def test_before_the_first_pair_nothing_happens(payloads, calls) -> None:
    alone = Alone(payloads)
    alone.show(pair=NO_PAIR)
    assert not alone.at(3.5 * PERIOD).any()
    assert calls == []
    alone.show(pair=payloads.pair)
    alone.at(5 * PERIOD)
    assert calls == [2]


def test_its_parameters_are_those_given(payloads) -> None:
    with pytest.raises(ValueError, match="evidence or paper"):
        Alone(payloads, SegmentParameters(method="none")).at(PERIOD)


@pytest.mark.parametrize("given", [True, False])
def test_the_function_is_handed_the_parameters_given_or_those_by_default(payloads, monkeypatch, given) -> None:
    handed = []
    monkeypatch.setattr(mask_propagator, "segment", lambda *arguments: handed.append(arguments) or arguments[0])
    parameters, bfif = SegmentParameters(method="paper"), BFIFParameters(explained_min=0.3)
    system = MaskPropagator(CAMERA, PERIOD, OFFSET, *((parameters, bfif) if given else ()))
    simulator = Simulator(system)
    for name in ("pair", "expected_flow", "optical_flow", "groups"):
        value = Value[object](getattr(payloads, name))
        system.GetInputPort(name).FixValue(simulator.get_mutable_context(), value)
    for name, above in (("above_table_reference", payloads.above_0), ("above_table", payloads.above_1)):
        system.GetInputPort(name).FixValue(simulator.get_mutable_context(), Value[object](above))
    simulator.AdvanceTo(PERIOD / 2)
    ((before, *inputs, see_whole, handed_parameters, handed_bfif),) = handed
    assert before.mask.shape == CAMERA.shape
    for value, expected in zip(
        inputs,
        (
            payloads.pair,
            payloads.expected_flow,
            payloads.optical_flow,
            payloads.groups,
            payloads.above_0,
            payloads.above_1,
        ),
        strict=True,
    ):
        np.testing.assert_equal(value, expected)
    assert see_whole() is payloads.above_1
    assert handed_parameters == (parameters if given else SegmentParameters())
    assert handed_bfif == (bfif if given else BFIFParameters())


def test_two_runs_with_the_same_inputs_give_the_same_bytes(payloads) -> None:
    literal = SegmentParameters(method="paper")  # which labels what moves in the first pair
    masks = [Alone(payloads, literal).at(PERIOD) for _ in range(2)]
    assert masks[0].any()
    assert masks[0].tobytes() == masks[1].tobytes()
