"""The one memory of frames: (I_t-1, I_t, theta_t-1, theta_t) and what stands on the table in both."""

from collections.abc import Callable
from dataclasses import replace

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from riseg_drake.geometry.rgbd import NO_FRAME, NO_PAIR
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE
from riseg_drake.segmentation.camera_motion import CameraMotionParameters
from riseg_drake.segmentation.frame_pairs import FramePairParameters
from riseg_drake.segmentation.remembered_pair import PassedOver, RememberedPair, with_frame
from riseg_drake.segmentation.table_plane import NoPlaneError
from riseg_drake.systems.value_input import ValueInput


class FramePairMemory(LeafSystem):
    """Takes in a frame whenever its time is new, and pairs it with the right reference.

    All stages read the same pair in the same tick: pairing happens here and nowhere else.

    All outputs are of the pair in memory; before the first frame that is NO_PAIR, with nothing above the table.

    Inputs:
        frame: Frame.
        above_table: AboveTable of that frame.
        flow_span: effective flow found in the pair that is in memory [1], pixels.
        settled_pair: FramePair, that pair as `CameraMotion` has it; where it is left open the table alone tells
            how far poses err.

    Outputs:
        pair: FramePair.
        whole_pair: FramePair, the same in all pixels that the camera gave.
        whole_frame: Frame, that of t in all its pixels.
        above_table_reference: AboveTable at t-1.
        above_table: AboveTable at t.
        pose_error: PoseError, what the table showed of it so far.
        passed_over: PassedOver, the last frame if it shows no table, and was left out.
        pair_time: time of the frame at t [1], s; 0 before the first.
    """

    def __init__(
        self,
        period: float,
        offset: float,
        parameters: FramePairParameters | None = None,
        camera_motion: CameraMotionParameters | None = None,
    ) -> None:
        """Look for a new frame every `period` s, `offset` s after the camera's tick."""
        super().__init__()
        self.set_name("FramePair")
        self._parameters = parameters or FramePairParameters()
        self._camera_motion = camera_motion or CameraMotionParameters()
        self._frame = ValueInput(self, "frame", NO_FRAME)
        self._above = ValueInput(self, "above_table", NOTHING_ABOVE_TABLE)
        self._flow_span = self.DeclareVectorInputPort("flow_span", 1)
        self._settled = ValueInput(self, "settled_pair", NO_PAIR)
        self._memory = self.DeclareAbstractState(AbstractValue.Make(RememberedPair()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._take_frame)
        for name, read in (
            ("pair", lambda memory: memory.pair),
            ("whole_pair", lambda memory: memory.pair.whole),
            ("whole_frame", lambda memory: memory.pair.current.whole),
            ("above_table_reference", lambda memory: memory.above_0),
            ("above_table", lambda memory: memory.above_1),
            ("pose_error", lambda memory: memory.pose_error),
            ("passed_over", lambda memory: memory.passed_over),
        ):
            self._declare_output(name, read)
        self.DeclareVectorOutputPort(
            "pair_time", 1, self._calc_pair_time, prerequisites_of_calc={self.all_state_ticket()}
        )

    def _take_frame(self, context: Context, state: State) -> EventStatus:
        memory, frame = self._recall(context), self._frame.Eval(context)
        if frame.time <= max(memory.pair.current.time, memory.passed_over.time):
            # Said so, lest all that follows from the state be computed anew: flow, for one.
            return EventStatus.DidNothing()
        # Nothing has flowed before there is a pair: the way to the span leads through both frames.
        flow_span = left = 0.0
        if memory.pair is not NO_PAIR:
            flow_span = float(self._flow_span.Eval(context)[0])
            left = self._settled.Eval(context).given_residual if self._settled.HasValue(context) else 0.0
        try:
            above = self._above.Eval(context)
        except NoPlaneError as error:
            following = replace(memory, passed_over=PassedOver(frame.time, str(error)))
        else:
            following = with_frame(memory, frame, above, flow_span, self._parameters, self._camera_motion, left)
        state.get_mutable_abstract_state(self._memory).set_value(following)
        return EventStatus.Succeeded()

    def _recall(self, context: Context) -> RememberedPair:
        return context.get_abstract_state(int(self._memory)).get_value()

    def _declare_output(self, name: str, read: Callable[[RememberedPair], object]) -> None:
        def calc(context: Context, output: AbstractValue) -> None:
            output.set_value(read(self._recall(context)))

        self.DeclareAbstractOutputPort(
            name,
            AbstractValue.Make(read(RememberedPair())).Clone,
            calc,
            prerequisites_of_calc={self.all_state_ticket()},
        )

    def _calc_pair_time(self, context: Context, output: BasicVector) -> None:
        output[0] = max(0.0, self._recall(context).pair.current.time)
