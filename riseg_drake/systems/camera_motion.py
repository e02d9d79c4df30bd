"""The camera's motion between the two frames of a pair, set right where poses err, as a system."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem

from riseg_drake.geometry.rgbd import NO_PAIR
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE
from riseg_drake.segmentation.camera_motion import CameraMotionParameters, PoseError, settled_pair
from riseg_drake.segmentation.noise import MeasurementNoise
from riseg_drake.segmentation.optical_flow import NO_FLOW
from riseg_drake.systems.stage_clock import timed
from riseg_drake.systems.value_input import ValueInput


class CameraMotion(LeafSystem):
    """What of the poses of a pair can be believed.

    Inputs:
        pair: FramePair.
        optical_flow: O_t [H, W, 2], pixels.
        above_table_reference: AboveTable at t-1.
        above_table: AboveTable at t.
        pose_error: PoseError.

    Outputs:
        pair: FramePair, the same where the poses are exact.
    """

    def __init__(
        self, parameters: CameraMotionParameters | None = None, noise: MeasurementNoise | None = None
    ) -> None:
        super().__init__()
        self.set_name("CameraMotion")
        self._parameters, self._noise = parameters or CameraMotionParameters(), noise or MeasurementNoise()
        self._pair = ValueInput(self, "pair", NO_PAIR)
        self._optical_flow = ValueInput(self, "optical_flow", NO_FLOW)
        self._above_0 = ValueInput(self, "above_table_reference", NOTHING_ABOVE_TABLE)
        self._above_1 = ValueInput(self, "above_table", NOTHING_ABOVE_TABLE)
        self._pose_error = ValueInput(self, "pose_error", PoseError())
        self.DeclareAbstractOutputPort(
            "pair",
            AbstractValue.Make(NO_PAIR).Clone,
            self._calc_pair,
            prerequisites_of_calc={self.all_input_ports_ticket()},
        )

    @timed
    def _calc_pair(self, context: Context, output: AbstractValue) -> None:
        pair = self._pair.Eval(context)
        if pair is not NO_PAIR:
            pair = settled_pair(
                pair,
                self._optical_flow.Eval(context),
                self._above_0.Eval(context),
                self._above_1.Eval(context),
                self._pose_error.Eval(context),
                self._noise,
                self._parameters,
            )
        output.set_value(pair)
