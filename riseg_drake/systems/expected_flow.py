"""GetExpectedFlow (Alg. 2, line 1) as a system."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem

from riseg_drake.geometry.rgbd import NO_PAIR
from riseg_drake.segmentation.expected_flow import expected_flow
from riseg_drake.segmentation.optical_flow import NO_FLOW
from riseg_drake.systems.stage_clock import timed
from riseg_drake.systems.value_input import ValueInput


class ExpectedFlow(LeafSystem):
    """E_t from depth and forward kinematics.

    Inputs:
        pair: FramePair.

    Outputs:
        expected_flow: [H, W, 2] float32, pixels, NaN where depth is invalid.
    """

    def __init__(self) -> None:
        super().__init__()
        self.set_name("ExpectedFlow")
        self._pair = ValueInput(self, "pair", NO_PAIR)
        self.DeclareAbstractOutputPort(
            "expected_flow",
            AbstractValue.Make(NO_FLOW).Clone,
            self._calc_expected_flow,
            prerequisites_of_calc={self.all_input_ports_ticket()},
        )

    @timed
    def _calc_expected_flow(self, context: Context, output: AbstractValue) -> None:
        pair = self._pair.Eval(context)
        if pair is NO_PAIR:
            output.set_value(NO_FLOW)
            return
        output.set_value(expected_flow(pair.reference.depth, pair.X_C1C0, pair.current.intrinsics))
