"""Lines 3 to 6 of Alg. 2 as a system: effective flow, body frames, twists, groups."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from riseg_drake.geometry.rgbd import NO_PAIR
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE
from riseg_drake.segmentation.bfif import BFIFParameters, group_body_frames, no_groups
from riseg_drake.segmentation.optical_flow import NO_FLOW
from riseg_drake.systems.stage_clock import timed
from riseg_drake.systems.value_input import ValueInput


class BFIFGrouper(LeafSystem):
    """G_t: body frames on what moves, grouped by their spatial twists.

    Body frames are drawn from a generator seeded by `seed` and the frame's number, so the same pair
    gives the same groups.

    Inputs:
        pair: FramePair.
        expected_flow: E_t [H, W, 2], pixels.
        optical_flow: O_t [H, W, 2], pixels.
        above_table: AboveTable at t-1.

    Outputs:
        groups: BFIFGroups.
        flow_span: effective flow of the fastest group [1], pixels; 0 if there is none.
    """

    def __init__(self, parameters: BFIFParameters | None = None, seed: int = 0) -> None:
        super().__init__()
        self.set_name("BFIFGrouper")
        self._parameters, self._seed = parameters or BFIFParameters(), seed
        self._pair = ValueInput(self, "pair", NO_PAIR)
        self._expected_flow = ValueInput(self, "expected_flow", NO_FLOW)
        self._optical_flow = ValueInput(self, "optical_flow", NO_FLOW)
        self._above = ValueInput(self, "above_table", NOTHING_ABOVE_TABLE)
        self._groups = self.DeclareAbstractOutputPort(
            "groups",
            AbstractValue.Make(no_groups()).Clone,
            self._calc_groups,
            prerequisites_of_calc={self.all_input_ports_ticket()},
        )
        self.DeclareVectorOutputPort(
            "flow_span", 1, self._calc_flow_span, prerequisites_of_calc={self.all_input_ports_ticket()}
        )

    @timed
    def _calc_groups(self, context: Context, output: AbstractValue) -> None:
        pair = self._pair.Eval(context)
        if pair is NO_PAIR:
            output.set_value(no_groups())
            return
        output.set_value(
            group_body_frames(
                pair,
                self._expected_flow.Eval(context),
                self._optical_flow.Eval(context),
                self._above.Eval(context),
                self._parameters,
                np.random.default_rng([self._seed, pair.current.sequence]),
            )
        )

    def _calc_flow_span(self, context: Context, output: BasicVector) -> None:
        output[0] = self._groups.Eval(context).flow_span
