"""Fewer pixels of a frame as a system, for the stages that must keep up with a camera."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem

from riseg_drake.geometry.reduction import reduced
from riseg_drake.geometry.rgbd import NO_FRAME
from riseg_drake.systems.stage_clock import timed
from riseg_drake.systems.value_input import ValueInput


class FrameReducer(LeafSystem):
    """The frame in fewer pixels, which has the whole one as its `source`.

    Inputs:
        frame: Frame.

    Outputs:
        frame: Frame.
    """

    def __init__(self, width: int) -> None:
        """As few pixels to a row as are not less than `width`; 0: the frame as it is."""
        super().__init__()
        self.set_name("FrameReducer")
        self._width = width
        self._frame = ValueInput(self, "frame", NO_FRAME)
        self.DeclareAbstractOutputPort(
            "frame",
            AbstractValue.Make(NO_FRAME).Clone,
            self._calc_frame,
            prerequisites_of_calc={self.all_input_ports_ticket()},
        )

    @timed
    def _calc_frame(self, context: Context, output: AbstractValue) -> None:
        output.set_value(reduced(self._frame.Eval(context), self._width))
