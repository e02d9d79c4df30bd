"""GetObjsAboveTable (Alg. 3, line 1) as a system, once for each frame."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem

from riseg_drake.segmentation.above_table import AboveTableParameters, objects_above_table
from riseg_drake.systems.stage_clock import timed


class ObjectsAboveTable(LeafSystem):
    """Which pixels see something that stands on the table.

    Inputs:
        frame: Frame, or None.

    Outputs:
        above_table: AboveTable; None without a frame.
    """

    def __init__(self, parameters: AboveTableParameters | None = None) -> None:
        super().__init__()
        self.set_name("ObjectsAboveTable")
        self._parameters = parameters or AboveTableParameters()
        self._frame = self.DeclareAbstractInputPort("frame", AbstractValue.Make(object()))
        self.DeclareAbstractOutputPort(
            "above_table",
            lambda: AbstractValue.Make(object()),
            self._calc_above_table,
            prerequisites_of_calc={self.all_input_ports_ticket()},
        )

    @timed
    def _calc_above_table(self, context: Context, output: AbstractValue) -> None:
        frame = self._frame.Eval(context)
        output.set_value(None if frame is None else objects_above_table(frame, self._parameters))
