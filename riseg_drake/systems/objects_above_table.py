"""GetObjsAboveTable (Alg. 3, line 1) as a system, once for each frame."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem

from riseg_drake.geometry.rgbd import NO_FRAME
from riseg_drake.segmentation.above_table import (
    NOTHING_ABOVE_TABLE,
    AboveTableParameters,
    objects_above_table,
)
from riseg_drake.systems.stage_clock import timed
from riseg_drake.systems.value_input import ValueInput


class ObjectsAboveTable(LeafSystem):
    """Which pixels see something that stands on the table.

    Inputs:
        frame: Frame.

    Outputs:
        above_table: AboveTable.
    """

    def __init__(self, parameters: AboveTableParameters | None = None) -> None:
        super().__init__()
        self.set_name("ObjectsAboveTable")
        self._parameters = parameters or AboveTableParameters()
        self._frame = ValueInput(self, "frame", NO_FRAME)
        self.DeclareAbstractOutputPort(
            "above_table",
            AbstractValue.Make(NOTHING_ABOVE_TABLE).Clone,
            self._calc_above_table,
            prerequisites_of_calc={self.all_input_ports_ticket()},
        )

    @timed
    def _calc_above_table(self, context: Context, output: AbstractValue) -> None:
        frame = self._frame.Eval(context)
        output.set_value(
            NOTHING_ABOVE_TABLE if frame is NO_FRAME else objects_above_table(frame, self._parameters)
        )
