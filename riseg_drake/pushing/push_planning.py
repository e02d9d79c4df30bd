"""From one image and its mask to a push with the arm's path: Alg. 3 with its feet on the ground."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pushing.arm_path import PushPath
from riseg_drake.pushing.decision import Decision, PathStage
from riseg_drake.pushing.find_action import FindActionParameters, find_action
from riseg_drake.pushing.push import Push
from riseg_drake.pushing.push_path import PushPathParameters, plan_push_path
from riseg_drake.pushing.table_map import SeenTable, map_table
from riseg_drake.pushing.tried_pushes import KnownScene, TriedPush
from riseg_drake.robot.kinematics import PandaKinematics

LEANS = 0.1
"""Sine of the angle from straight down from which on a fixed camera has a side that it looks from."""


@dataclass
class PushPlanningParameters:
    """Everything that planning a push can be told."""

    action: FindActionParameters = field(default_factory=FindActionParameters)
    path: PushPathParameters = field(default_factory=PushPathParameters)


def plan_push(
    frame: Frame,
    above: SeenTable,
    mask: NDArray,
    q_observe: NDArray,
    kinematics: PandaKinematics,
    rng: np.random.Generator,
    tried: Sequence[TriedPush] = (),
    parameters: PushPlanningParameters | None = None,
    found: NDArray | None = None,
) -> Decision:
    """The next push, with a path from the posture q_observe [7] and back, or why there is none.

    Args:
        frame: what the camera saw from that posture.
        above: what stands on the table there.
        mask: [H, W], L_t without the objects in doubt.
        q_observe: [7], where the arm is and returns to, rad.
        kinematics: of the arm.
        rng: for the clustering.
        tried: pushes made so far.
        parameters: the defaults if None.
        found: [H, W], L_t with them: they are pushed after what has never moved. None: nobody tells
            them from it.
    """
    parameters = parameters or PushPlanningParameters()
    table = map_table(frame, above, mask, parameters.action.table, found)
    known = KnownScene(table, tried, _heading(kinematics, q_observe))

    def path_of(push: Push) -> PushPath | PathStage:
        return plan_push_path(push, kinematics, q_observe, parameters.path)

    return find_action(known, rng, kinematics.tool, parameters.action, path_of)


def _heading(kinematics: PandaKinematics, q_observe: NDArray) -> NDArray[np.float64] | None:
    """The direction [2] in W in which a push is seen best; None where all are alike.

    A camera on the wrist turns with the push, and turns least ahead. One that is fixed sees best what comes
    towards it: then the tool stands behind what it pushes.
    """
    if kinematics.fixed_camera is None:
        ahead_W = kinematics.X_WE(q_observe)[:2, 0]
    else:
        ahead_W = -kinematics.fixed_camera[:2, 2]
    length = float(np.linalg.norm(ahead_W))
    return ahead_W / length if length > LEANS else None
