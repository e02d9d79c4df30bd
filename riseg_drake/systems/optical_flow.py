"""OpticalFlow (Alg. 2, line 2) as a system, around any flow method."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem

from riseg_drake.geometry.rgbd import NO_PAIR
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE
from riseg_drake.segmentation.optical_flow import NO_FLOW, DisFlow, FlowMethod, flow_around
from riseg_drake.systems.stage_clock import timed
from riseg_drake.systems.value_input import ValueInput


class OpticalFlow(LeafSystem):
    """O_t by any method that follows the `FlowMethod` protocol; DIS by default.

    Inputs:
        pair: FramePair.
        above_table: AboveTable at t-1; may be left unconnected.

    Outputs:
        optical_flow: O_t [H, W, 2] float32, pixels; of the whole image, or if `above_table` is connected,
            in and around what stands on the table, NaN elsewhere.
    """

    def __init__(self, method: FlowMethod | None = None) -> None:
        super().__init__()
        self.set_name("OpticalFlow")
        self._method = method or DisFlow()
        self._pair = ValueInput(self, "pair", NO_PAIR)
        self._above = ValueInput(self, "above_table", NOTHING_ABOVE_TABLE)
        self.DeclareAbstractOutputPort(
            "optical_flow",
            AbstractValue.Make(NO_FLOW).Clone,
            self._calc_optical_flow,
            prerequisites_of_calc={self.all_input_ports_ticket()},
        )

    @timed
    def _calc_optical_flow(self, context: Context, output: AbstractValue) -> None:
        pair = self._pair.Eval(context)
        if pair is NO_PAIR:
            output.set_value(NO_FLOW)
        elif self._above.HasValue(context):
            output.set_value(flow_around(self._above.Eval(context), pair, self._method))
        else:
            output.set_value(self._method(pair.reference.color, pair.current.color))
