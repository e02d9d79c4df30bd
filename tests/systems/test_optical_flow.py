"""OpticalFlow through its ports."""

import numpy as np
import pytest

from riseg_drake.segmentation.optical_flow import DisFlow, DisFlowParameters
from riseg_drake.systems.optical_flow import OpticalFlow
from tests.systems.ports import evaluate, port_names


def test_ports_have_the_names_of_the_contract() -> None:
    assert port_names(OpticalFlow()) == (["pair", "above_table"], ["optical_flow"])


@pytest.mark.parametrize("preset", [None, "fast"])
def test_dense_inverse_search_goes_from_the_reference_to_the_current_frame(payloads, preset) -> None:
    method = DisFlow(DisFlowParameters(preset)) if preset else None
    flow = evaluate(OpticalFlow(method), "optical_flow", pair=payloads.pair)
    assert flow.dtype == np.float32
    images = payloads.pair.reference.color, payloads.pair.current.color
    np.testing.assert_array_equal(flow, (method or DisFlow())(*images))


def test_where_nothing_stands_no_flow_is_worked_out(payloads) -> None:
    flow = evaluate(OpticalFlow(), "optical_flow", pair=payloads.pair, above_table=payloads.above_0)
    whole = evaluate(OpticalFlow(), "optical_flow", pair=payloads.pair)
    mask = payloads.above_0.mask
    assert np.isnan(flow).any()
    assert np.median(np.linalg.norm(flow[mask] - whole[mask], axis=-1)) < 0.2


def test_anything_that_can_be_called_stands_in_for_it(payloads) -> None:
    calls = []

    def nothing_flows(color_0: np.ndarray, color_1: np.ndarray) -> np.ndarray:
        calls.append((color_0, color_1))
        return np.zeros((*color_0.shape[:2], 2), np.float32)

    flow = evaluate(OpticalFlow(nothing_flows), "optical_flow", pair=payloads.pair)
    assert not flow.any()
    assert len(calls) == 1
    assert calls[0][0] is payloads.pair.reference.color
    assert calls[0][1] is payloads.pair.current.color
