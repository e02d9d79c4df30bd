"""Segment (Alg. 2, line 7) as a system, and the one place where L_t-1 is kept."""

from collections.abc import Callable
from typing import Any

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import NO_MASK, NO_PAIR, FramePair
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE
from riseg_drake.segmentation.bfif import BFIFParameters, no_groups
from riseg_drake.segmentation.optical_flow import NO_FLOW
from riseg_drake.segmentation.segment import SegmentParameters, segment
from riseg_drake.segmentation.segmentation import Segmentation, nothing_segmented
from riseg_drake.segmentation.untouched import untouched_clusters
from riseg_drake.systems.stage_clock import timed
from riseg_drake.systems.value_input import ValueInput


class MaskPropagator(LeafSystem):
    """L_t from G_t, O_t and L_t-1, once for each new frame.

    Outputs are as of the last update.

    Inputs:
        pair: FramePair.
        expected_flow: E_t [H, W, 2], pixels.
        optical_flow: O_t [H, W, 2], pixels.
        groups: BFIFGroups.
        above_table_reference: AboveTable at t-1.
        above_table: AboveTable at t.
        whole_above_table: the same of the whole frame, which is read at rests alone; to be connected where the
            pair's frames are reduced.

    Outputs:
        mask: L_t [H, W] uint16, 0 = background.
        settled_mask: the same without the objects that may be two, for whoever plans pushes.
        decided: bool, whether the scene is at rest and the mask that of this rest; what comes while something
            moves may change then.
        untouched: [H, W] uint16, clusters of depth among what has not moved yet, guessed; no ids.
        segmentation: Segmentation, the ids, also of objects out of sight, where they are remembered, and the
            confidence of each.
    """

    def __init__(
        self,
        intrinsics: Intrinsics,
        period: float,
        offset: float,
        parameters: SegmentParameters | None = None,
        bfif: BFIFParameters | None = None,
    ) -> None:
        """Update every `period` s, `offset` s after the camera's tick and after the frame pair's.

        `bfif` is what the groups are made with.
        """
        super().__init__()
        self.set_name("MaskPropagator")
        self._parameters, self._bfif = parameters or SegmentParameters(), bfif or BFIFParameters()
        self._pair = ValueInput(self, "pair", NO_PAIR)
        self._expected_flow = ValueInput(self, "expected_flow", NO_FLOW)
        self._optical_flow = ValueInput(self, "optical_flow", NO_FLOW)
        self._groups = ValueInput(self, "groups", no_groups())
        self._above_0 = ValueInput(self, "above_table_reference", NOTHING_ABOVE_TABLE)
        self._above_1 = ValueInput(self, "above_table", NOTHING_ABOVE_TABLE)
        self._whole_above_1 = ValueInput(self, "whole_above_table", NOTHING_ABOVE_TABLE)
        nothing = nothing_segmented(intrinsics.shape)
        self._state = self.DeclareAbstractState(AbstractValue.Make(nothing))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)
        self._declare("mask", NO_MASK, lambda segmentation: segmentation.mask)
        self._declare("settled_mask", NO_MASK, lambda segmentation: segmentation.settled_mask)
        self._declare("decided", True, lambda segmentation: segmentation.decided)
        self._declare("untouched", NO_MASK, untouched_clusters)
        self._declare("segmentation", nothing, lambda segmentation: segmentation)

    def _declare(self, name: str, model: Any, read: Callable[[Segmentation], Any]) -> None:
        """An output that shows something of L_t."""

        def calc(context: Context, output: AbstractValue) -> None:
            output.set_value(read(self._segmentation(context)))

        self.DeclareAbstractOutputPort(
            name, AbstractValue.Make(model).Clone, calc, prerequisites_of_calc={self.all_state_ticket()}
        )

    def _segmentation(self, context: Context) -> Segmentation:
        return context.get_abstract_state(self._state).get_value()

    def _update(self, context: Context, state: State) -> EventStatus:
        pair = self._pair.Eval(context)
        if pair is NO_PAIR or pair.current.sequence == self._segmentation(context).sequence:
            return EventStatus.DidNothing()
        self._segment(context, state, pair)
        return EventStatus.Succeeded()

    @timed
    def _segment(self, context: Context, state: State, pair: FramePair) -> None:
        seen_at_rest = self._above_1 if pair.current.source is None else self._whole_above_1
        following = segment(
            self._segmentation(context),
            pair,
            self._expected_flow.Eval(context),
            self._optical_flow.Eval(context),
            self._groups.Eval(context),
            self._above_0.Eval(context),
            self._above_1.Eval(context),
            lambda: seen_at_rest.Eval(context),
            self._parameters,
            self._bfif,
        )
        state.get_mutable_abstract_state(self._state).set_value(following)
