"""ExpectedFlow through its ports."""

import numpy as np

from riseg_drake.systems.expected_flow import ExpectedFlow
from tests.systems.ports import evaluate, port_names


def test_ports_have_the_names_of_the_contract() -> None:
    assert port_names(ExpectedFlow()) == (["pair"], ["expected_flow"])


def test_it_is_the_flow_of_the_cameras_motion(payloads) -> None:
    flow = evaluate(ExpectedFlow(), "expected_flow", pair=payloads.pair)
    assert flow.dtype == np.float32
    np.testing.assert_array_equal(flow, payloads.expected_flow)
    # The camera goes 2 mm to the right, 0.45 m above the table.
    assert np.median(flow[..., 0]) < -0.002 / 0.45 * payloads.pair.current.intrinsics.fx * 0.95
