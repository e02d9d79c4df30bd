"""From the station's ports to one Frame: I_t with the kinematics that belong to it."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem
from pydrake.systems.sensors import ImageDepth32F, ImageRgba8U

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import NO_FRAME, Frame, sanitize_depth
from riseg_drake.systems.stage_clock import timed
from riseg_drake.systems.value_input import ValueInput


class FrameView(LeafSystem):
    """Colour, depth, time and theta_t of one moment, put together.

    Where the camera is and what the robot covers follows from theta_t, or is said by whoever knows it.

    Evaluating `frame` raises ValueError where images and intrinsics are of different size.

    Inputs:
        color_image: ImageRgba8U.
        depth_image: ImageDepth32F, m, aligned to colour.
        image_time: when both were taken [1], s.
        position: joint angles theta_t [num_positions], rad; there if anything follows from them.
        camera_pose: X_WC [4, 4]; there where `X_WC` is None.
        robot_pixels: [H, W] bool; there where `robot_mask` is None.

    Outputs:
        frame: Frame with `sequence` 0 (who stores frames counts them), NO_FRAME while there is no image.
    """

    def __init__(
        self,
        intrinsics: Intrinsics,
        X_WC: Callable[[NDArray], NDArray] | None,
        robot_mask: Callable[[NDArray], NDArray] | None,
        num_positions: int = 7,
    ) -> None:
        """`X_WC` and `robot_mask` give the camera's pose and the robot's own pixels at theta.

        Where one of them is None, an input port stands in for it.
        """
        super().__init__()
        self.set_name("FrameView")
        self._intrinsics, self._X_WC, self._robot_mask = intrinsics, X_WC, robot_mask
        self._color = self.DeclareAbstractInputPort("color_image", AbstractValue.Make(ImageRgba8U()))
        self._depth = self.DeclareAbstractInputPort("depth_image", AbstractValue.Make(ImageDepth32F()))
        self._time = self.DeclareVectorInputPort("image_time", 1)
        if X_WC is not None or robot_mask is not None:
            self._position = self.DeclareVectorInputPort("position", num_positions)
        if X_WC is None:
            self._pose = ValueInput(self, "camera_pose", np.eye(4))
        if robot_mask is None:
            self._robot_pixels = ValueInput(self, "robot_pixels", NO_FRAME.robot)
        self.DeclareAbstractOutputPort(
            "frame",
            AbstractValue.Make(NO_FRAME).Clone,
            self._calc_frame,
            prerequisites_of_calc={self.all_input_ports_ticket()},
        )

    @property
    def intrinsics(self) -> Intrinsics:
        """Of the camera whose images come in."""
        return self._intrinsics

    def _q(self, context: Context) -> NDArray[np.float64]:
        return self._position.Eval(context)

    @timed
    def _calc_frame(self, context: Context, output: AbstractValue) -> None:
        color, depth = self._color.Eval(context), self._depth.Eval(context)
        if color.width() == 0 or depth.width() == 0:  # no message has come yet
            output.set_value(NO_FRAME)
            return
        if {(image.height(), image.width()) for image in (color, depth)} != {self._intrinsics.shape}:
            raise ValueError(
                f"images of {color.width()}x{color.height()} (colour) and {depth.width()}x{depth.height()} "
                f"(depth), but the intrinsics are for {self._intrinsics.width}x{self._intrinsics.height}"
            )
        X_WC = self._pose.Eval(context) if self._X_WC is None else self._X_WC(self._q(context))
        robot = (
            self._robot_pixels.Eval(context) if self._robot_mask is None else self._robot_mask(self._q(context))
        )
        output.set_value(
            Frame(
                sequence=0,
                time=float(self._time.Eval(context)[0]),
                intrinsics=self._intrinsics,
                color=cv2.cvtColor(color.data, cv2.COLOR_RGBA2RGB),
                depth=sanitize_depth(depth.data[..., 0]),
                X_WC=X_WC,
                robot=robot,
            )
        )
