"""The wiring: station, segmentation (Alg. 2), planner (Alg. 3) and arm as one Diagram."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem, OutputPort

from riseg_drake.app.scenario import Scenario
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import FramePair
from riseg_drake.pushing.push import ArmPhase
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.robot.silhouette import RobotSilhouette
from riseg_drake.segmentation.optical_flow import DisFlow
from riseg_drake.segmentation.segment import Segmentation
from riseg_drake.systems.arm_motion import ArmMotion
from riseg_drake.systems.bfif_grouper import BFIFGrouper
from riseg_drake.systems.expected_flow import ExpectedFlow
from riseg_drake.systems.frame_pair import FramePairMemory
from riseg_drake.systems.frame_view import FrameView
from riseg_drake.systems.mask_propagator import MaskPropagator
from riseg_drake.systems.objects_above_table import ObjectsAboveTable
from riseg_drake.systems.optical_flow import OpticalFlow
from riseg_drake.systems.push_planner import PushPlanner

FRAME_OFFSET = 0.001
"""A frame is taken in this long after the camera's tick, s: at the tick itself it would be the last one."""
MASK_OFFSET = 0.002
"""L_t follows this long after the camera's tick, s: when the pair in memory is the new one."""
