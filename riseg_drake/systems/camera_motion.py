"""The camera's motion between the two frames of a pair, set right where poses err, as a system."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem

from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.segmentation.camera_motion import CameraMotionParameters, settled_pair
from riseg_drake.segmentation.noise import MeasurementNoise
from riseg_drake.systems.stage_clock import timed


class CameraMotion(LeafSystem):
    """What of the poses of a pair can be believed.

    Inputs:
        pair: FramePair, or None.
        optical_flow: O_t [H, W, 2], pixels.
        above_table_reference: AboveTable at t-1.
        above_table: AboveTable at t.
        pose_error: PoseError.

    Outputs:
        pair: FramePair, the same where the poses are exact; None without one.
    """

    def __init__(
        self, parameters: CameraMotionParameters | None = None, noise: MeasurementNoise | None = None
    ) -> None:
        super().__init__()
        self.set_name("CameraMotion")
        self._parameters, self._noise = parameters or CameraMotionParameters(), noise or MeasurementNoise()
        self._stages = [
            self.DeclareAbstractInputPort(name, AbstractValue.Make(object()))
            for name in ("pair", "optical_flow", "above_table_reference", "above_table", "pose_error")
        ]
        self.DeclareAbstractOutputPort(
            "pair",
            lambda: AbstractValue.Make(object()),
            self._calc_pair,
            prerequisites_of_calc={self.all_input_ports_ticket()},
        )

    def _calc_pair(self, context: Context, output: AbstractValue) -> None:
        pair: FramePair | None = self._stages[0].Eval(context)
        output.set_value(None if pair is None else self._settle(context, pair))

    @timed
    def _settle(self, context: Context, pair: FramePair) -> FramePair:
        optical_flow, above_0, above_1, error = (stage.Eval(context) for stage in self._stages[1:])
        return settled_pair(pair, optical_flow, above_0, above_1, error, self._noise, self._parameters)
