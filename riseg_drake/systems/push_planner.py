"""PushPlanner: Alg. 3, FindAction, behind ports."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem

from riseg_drake.geometry.rgbd import NO_MASK, NO_PAIR
from riseg_drake.pushing.decision import UNDECIDED
from riseg_drake.pushing.push_planning import PushPlanningParameters, plan_push
from riseg_drake.pushing.table_map import SeenTable
from riseg_drake.pushing.tried_pushes import TriedPush
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE
from riseg_drake.systems.stage_clock import timed
from riseg_drake.systems.value_input import ValueInput


class PushPlanner(LeafSystem):
    """What to push next, given what is segmented by now. Works only when its output is asked for.

    Inputs:
        pair: FramePair; the push is planned in its current frame.
        above_table: AboveTable of the current frame (GetObjsAboveTable), or whatever has its `mask`, `height`
            and `plane_W`.
        mask: L_t of the current frame without the objects in doubt, [H, W].
        position: the arm's commanded joint angles [7], rad; where the path begins and ends.
        tried_pushes: tuple of TriedPush; may be left unconnected.
        found: L_t with the objects in doubt, [H, W]; may be left unconnected: what is in doubt is then pushed
            as if it had never moved.

    Outputs:
        decision: Decision, a Push with its path or the reason why there is none; UNDECIDED where no frame
            has come yet.

    The same inputs give the same decision: the clustering's random numbers come from the seed and the
    frame's sequence number.
    """

    def __init__(
        self,
        kinematics: PandaKinematics,
        parameters: PushPlanningParameters | None = None,
        seed: int = 0,
    ):
        super().__init__()
        self.set_name("PushPlanner")
        self._kinematics = kinematics
        self._parameters = parameters or PushPlanningParameters()
        self._seed = seed
        self._pair = ValueInput(self, "pair", NO_PAIR)
        self._above: ValueInput[SeenTable] = ValueInput(self, "above_table", NOTHING_ABOVE_TABLE, SeenTable)
        self._mask = ValueInput(self, "mask", NO_MASK)
        self._position = self.DeclareVectorInputPort("position", 7)
        self._tried: ValueInput[tuple[TriedPush, ...]] = ValueInput(self, "tried_pushes", ())
        self._found = ValueInput(self, "found", NO_MASK)
        self.DeclareAbstractOutputPort(
            "decision",
            alloc=AbstractValue.Make(UNDECIDED).Clone,
            calc=self._calc_decision,
            prerequisites_of_calc={self.all_input_ports_ticket()},
        )

    @timed
    def _calc_decision(self, context: Context, output: AbstractValue) -> None:
        pair = self._pair.Eval(context)
        if pair is NO_PAIR:
            output.set_value(UNDECIDED)
            return
        frame = pair.current
        decision = plan_push(
            frame,
            self._above.Eval(context),
            self._mask.Eval(context),
            self._position.Eval(context),
            self._kinematics,
            np.random.default_rng([self._seed, frame.sequence]),
            self._tried.Eval(context) if self._tried.HasValue(context) else (),
            self._parameters,
            self._found.Eval(context) if self._found.HasValue(context) else None,
        )
        output.set_value(decision)
