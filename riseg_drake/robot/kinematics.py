"""Where the arm is, how it gets to a pose, and what it is about to touch."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Box, CollisionFilterDeclaration, GeometrySet, SceneGraphInspector
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction
from pydrake.multibody.tree import Frame, JacobianWrtVariable, ModelInstanceIndex
from pydrake.planning import RobotDiagramBuilder

from riseg_drake.robot.description import PandaDescription, add_panda
from riseg_drake.robot.inverse import panda_postures
from riseg_drake.robot.out_of_view import posture_out_of_view
from riseg_drake.robot.tool import NO_CAMERA, ToolError
from riseg_drake.robot.tool_shape import ToolShape, tool_shape

LIMIT_MARGIN = 0.05
"""Room that solutions keep to the ends of the joints' ranges, rad."""
MIN_CLEARANCE = 0.003
"""Room that solutions keep between arm, tool and table, m."""
OBSERVING_CLEARANCE = 0.02
"""The same where the arm looks at the scene from an angle, m."""
OBSERVE_HEIGHTS, OBSERVE_PITCHES = {"least": 0.1, "most": 1.5}, {"least": 0.0, "most": 1.2}
"""m and rad; from how far, and leaning by how much, a scenario may have the arm look."""

READY = np.array([0.0, -0.1, 0.0, -2.4, 0.0, 2.3, 0.0])
"""An elbow-up posture amid the joints' ranges, the flange pointing down and ahead, rad."""

_FREE_ANGLES = 181  # of joint 7 are tried for a pose
_TABLE_SIZE = (4.0, 4.0, 1.0)


def tip_pointing_down(p_WE: Sequence[float] | NDArray, yaw: float) -> NDArray[np.float64]:
    """X_WE [4, 4]: the tip at p_WE, the tool upright, the push (E's x axis) at `yaw` about W's z."""
    c, s = np.cos(yaw), np.sin(yaw)
    X_WE = np.eye(4)
    X_WE[:3, :3] = np.array([[c, s, 0], [s, -c, 0], [0, 0, -1]])
    X_WE[:3, 3] = p_WE
    return X_WE


class PandaKinematics:
    """The arm with its tool, alone above the table z = 0. Not for use by several threads at once."""

    def __init__(self, description: PandaDescription | None = None, X_WC: NDArray | None = None):
        """With X_WC [4, 4] the camera is fixed to the world there; without, it is on the tool."""
        description = description or PandaDescription()
        self.limits = description.limits
        """What the robot's joints can do."""
        builder = RobotDiagramBuilder(time_step=0.0)
        self.plant = builder.plant()
        self.parts = add_panda(self.plant, description, X_WC)
        table = self.plant.RegisterCollisionGeometry(
            self.plant.world_body(),
            RigidTransform([0, 0, -_TABLE_SIZE[2] / 2]),
            Box(*_TABLE_SIZE),
            "table",
            CoulombFriction(1, 1),
        )
        self.plant.Finalize()
        base = self.plant.GetBodyByName("panda_link0", self.parts.arm)
        builder.scene_graph().collision_filter_manager().Apply(
            CollisionFilterDeclaration().ExcludeBetween(
                GeometrySet(table), GeometrySet(self.plant.GetCollisionGeometriesForBody(base))
            )
        )
        self._diagram = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self._context = self._diagram.mutable_plant_context(self._root)
        self._flange = self.plant.GetFrameByName("panda_link8", self.parts.arm)
        self.fixed_camera = X_WC
        """X_WC [4, 4] of a camera fixed to the world; None: it moves with the tool."""
        self.X_EF = self._flange.CalcPose(self._context, self.tip_frame).GetAsMatrix4()
        """Pose of the flange (panda_link8) seen from the tip, [4, 4]."""
        self.ready = READY - np.arctan2(self.X_EF[0, 1], self.X_EF[0, 0]) * (np.arange(7) == 6)
        """READY [7], rad, with the tool's x axis ahead instead of the flange's: where a search starts."""
        parts = self.parts
        self._X_EC = (
            parts.camera_frame.CalcPose(self._context, parts.tip_frame).GetAsMatrix4()
            if parts.camera_frame is not None
            else None
        )
        self._tool_name = description.tool
        self.tool: ToolShape = tool_shape(
            self.plant, self.inspector, parts.tool, parts.tip_frame, self._flange, description.tool
        )
        """The tool as its collision geometry has it."""

    @property
    def tip_frame(self) -> Frame:
        """E, the tool's tip."""
        return self.parts.tip_frame

    @property
    def camera_frame(self) -> Frame:
        """C, the camera's optical frame. Raises ToolError where it should be on the tool and is not."""
        if self.parts.camera_frame is None:
            raise ToolError(f"{self._tool_name}: {NO_CAMERA}")
        return self.parts.camera_frame

    @property
    def X_EC(self) -> NDArray[np.float64]:
        """Pose of the camera on the tool, [4, 4]; of no meaning where it is fixed to the world.

        Raises ToolError where it should be on the tool and is not.
        """
        if self._X_EC is None:
            raise ToolError(f"{self._tool_name}: {NO_CAMERA}")
        return self._X_EC

    @property
    def inspector(self) -> SceneGraphInspector:
        """What shapes the arm and its tool have."""
        return self._diagram.scene_graph().model_inspector()

    @property
    def models(self) -> tuple[ModelInstanceIndex, ...]:
        """The arm, and its tool."""
        return self.parts.arm, self.parts.tool

    def X_WA(self, q: NDArray, frame: Frame) -> NDArray[np.float64]:
        """Pose [4, 4] of any frame of `plant` at joint angles q [7], rad."""
        self.plant.SetPositions(self._context, q)
        return frame.CalcPoseInWorld(self._context).GetAsMatrix4()

    def X_WC(self, q: NDArray) -> NDArray[np.float64]:
        """Pose of the camera's optical frame at q [7], [4, 4]."""
        return self.X_WA(q, self.camera_frame)

    def X_WE(self, q: NDArray) -> NDArray[np.float64]:
        """Pose of the tool's tip at q [7], [4, 4]."""
        return self.X_WA(q, self.tip_frame)

    def tip_jacobian(self, q: NDArray) -> NDArray[np.float64]:
        """J [6, 7] with V_WE = J dq/dt, V_WE = [omega; v] of E measured and expressed in W."""
        self.plant.SetPositions(self._context, q)
        world = self.plant.world_frame()
        return self.plant.CalcJacobianSpatialVelocity(
            self._context, JacobianWrtVariable.kV, self.tip_frame, np.zeros(3), world, world
        )

    def clearance(self, q: NDArray, reach: float = 0.1) -> float:
        """Smallest signed distance of arm, tool and camera to the table and among each other, m.

        At joint angles q [7], rad. Negative where they penetrate; `reach`, m, where nothing is nearer.
        """
        self.plant.SetPositions(self._context, q)
        query = self.plant.get_geometry_query_input_port().Eval(self._context)
        pairs = query.ComputeSignedDistancePairwiseClosestPoints(reach)
        return min((pair.distance for pair in pairs), default=reach)

    def postures(self, X_WE: NDArray, margin: float = LIMIT_MARGIN) -> NDArray[np.float64]:
        """A dense sample [N, 7] of postures with the tip at X_WE [4, 4], `margin` rad inside limits."""
        ends = self.limits.position_lower[6], self.limits.position_upper[6]
        q = panda_postures(X_WE @ self.X_EF, np.linspace(*ends, _FREE_ANGLES))
        return q[(self.limits.room(q) >= margin).all(axis=1)]

    def solve_ik(
        self,
        X_WE: NDArray,
        q_near: NDArray | None = None,
        margin: float = LIMIT_MARGIN,
        min_clearance: float = MIN_CLEARANCE,
    ) -> NDArray[np.float64] | None:
        """Joint angles [7], rad, with the tip exactly at X_WE [4, 4], free of collision, or None.

        Of all such postures the one nearest to q_near [7] (`ready` if None) is taken (largest joint
        difference), with some liking for room to the joints' limits.
        """
        return next(self.free_postures(X_WE, q_near, margin, min_clearance), None)

    def free_postures(
        self,
        X_WE: NDArray,
        q_near: NDArray | None = None,
        margin: float = LIMIT_MARGIN,
        min_clearance: float = MIN_CLEARANCE,
        apart: float = 0.3,
    ) -> Iterator[NDArray[np.float64]]:
        """Joint angles [7], rad, as `solve_ik` takes them for X_WE [4, 4], near q_near [7], and then, if asked
        again, the next best of which some joint is `apart`, rad, from where it is in each before."""
        q_near = self.ready if q_near is None else q_near
        q = self.postures(X_WE, margin)
        q = q[np.argsort(np.abs(q - q_near).max(axis=1) - 0.2 * self.limits.room(q).min(axis=1))]
        while len(q):
            candidate, q = q[0], q[1:]
            if self.clearance(candidate) >= min_clearance:
                yield candidate
                q = q[np.abs(q - candidate).max(axis=1) >= apart]

    def trace_ik(
        self,
        path: Sequence[NDArray],
        q_start: NDArray,
        margin: float = LIMIT_MARGIN,
        min_clearance: float = MIN_CLEARANCE,
    ) -> list[NDArray[np.float64]] | None:
        """Joint angles [7] for poses X_WE [4, 4] of a path, without a jump; q_start is near the first.

        Newton steps on the pose; the spare freedom is spent on staying off the joints' limits. None
        where the path leaves the limits by `margin`, touches something, or cannot be followed. Poses
        should be no more than some 2 cm or 0.1 rad apart.
        """
        traced = []
        q = np.asarray(q_start, np.float64)
        for X_WE in path:
            step = self._follow(X_WE, q)
            if step is None or not self.limits.contains(step, margin) or self.clearance(step) < min_clearance:
                return None
            q = step
            traced.append(q)
        return traced

    def _follow(self, X_WE: NDArray, q: NDArray) -> NDArray[np.float64] | None:
        """The posture at X_WE that continues q: converged to 1 um and 1 urad, or None."""
        half_range = (self.limits.position_upper - self.limits.position_lower) / 2
        for iteration in range(20):
            error = pose_error(self.X_WE(q), X_WE)
            if np.abs(error).max() < 1e-6:
                return q
            J = self.tip_jacobian(q)
            J_pinv = J.T @ np.linalg.solve(J @ J.T + 1e-8 * np.eye(6), np.eye(6))
            dq = J_pinv @ error
            if iteration == 0:
                # Grows steeply near a limit; bounded by the step itself, so that the path stays smooth.
                crowding = ((q - self.limits.position_middle) / half_range) ** 5 / half_range
                away = -(crowding - J_pinv @ (J @ crowding))
                dq += 0.3 * np.linalg.norm(error) * np.clip(away, -1, 1)
            q = q + np.clip(dq, -0.3, 0.3)
        return None


def pose_error(X_WA: NDArray, X_WB: NDArray) -> NDArray[np.float64]:
    """The small twist [omega; p] [6] in W that carries A onto B, to first order in the angle."""
    R_AB_W = X_WB[:3, :3] @ X_WA[:3, :3].T
    twisting = np.array([R_AB_W[2, 1] - R_AB_W[1, 2], R_AB_W[0, 2] - R_AB_W[2, 0], R_AB_W[1, 0] - R_AB_W[0, 1]])
    return np.concatenate([twisting / 2, X_WB[:3, 3] - X_WA[:3, 3]])


def observe_pose(
    p_WT: Sequence[float] | NDArray, distance: float, X_EC: NDArray, yaw: float = 0.0, pitch: float = 0.0
) -> NDArray[np.float64]:
    """X_WE [4, 4] with the camera looking at p_WT [3] from `distance` m, straight down with pitch 0.

    `yaw` is the direction of the image's upper edge about W's z axis; 0 is away from the robot, so that
    the tool stands on the robot's side of what is looked at. `pitch`, rad, turns the camera about the
    image's horizontal axis, so that it looks more towards where the upper edge was.
    """
    X_WE = tip_pointing_down(np.zeros(3), yaw)
    s, c = np.sin(pitch), np.cos(pitch)
    X_WE[:3, :3] @= np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])  # E's y is the image's horizontal axis
    R_WC = X_WE[:3, :3] @ X_EC[:3, :3]
    X_WE[:3, 3] = np.asarray(p_WT) - distance * R_WC[:, 2] - X_WE[:3, :3] @ X_EC[:3, 3]
    return X_WE


def observation_posture(
    kinematics: PandaKinematics,
    centre_W: Sequence[float],
    height: float,
    given: Sequence[float] = (),
    pitch: float = 0.0,
) -> NDArray[np.float64]:
    """Joint angles [7], rad, to look from: those given, or looking at a point of the table.

    Where the camera is fixed to the world, the arm waits out of its view of that point, and height and pitch
    are of no account. Where the view leans, the camera looks from that side of the point where the arm has
    most room to move.

    Args:
        kinematics: of the arm.
        centre_W: the point's x and y in W, m.
        height: of the camera above it, m; where the view leans its distance.
        given: joint angles, rad, to be used instead; may be empty.
        pitch: how far the view leans from straight down, rad.

    Raises:
        ValueError: these are not seven, or the arm cannot look from there.
    """
    if len(given):
        if len(given) != 7:
            raise ValueError(f"start_position: {len(given)} angles; expected 7, in rad")
        return np.array(given, np.float64)
    if kinematics.fixed_camera is not None:
        return posture_out_of_view(kinematics, centre_W)
    p_WT = [*centre_W, 0.0]
    if pitch:
        q = _roomiest(kinematics, p_WT, height, abs(pitch))
        leaning = f" leaning by observe_pitch: {pitch} rad"
    else:
        q = kinematics.solve_ik(observe_pose(p_WT, height, kinematics.X_EC))
        leaning = ""
    if q is None:
        raise ValueError(
            f"observe_height: no posture looks at {list(centre_W)} from {height} m{leaning}; with bar or hand "
            f"0.5 m above (0.5, 0) is within reach. {_tool_told(kinematics)}"
        )
    return q


def _tool_told(kinematics: PandaKinematics) -> str:
    """Where tip and camera are, by which a tool in millimetres or a camera that looks back is known."""
    X_EC = kinematics.X_EC
    off = np.degrees(np.arccos(np.clip(X_EC[2, 2], -1, 1)))
    return (
        f"The tip is {np.linalg.norm(kinematics.X_EF[:3, 3]):.2f} m from the flange, the camera "
        f"{np.linalg.norm(X_EC[:3, 3]):.2f} m from the tip, looking {off:.0f} degrees off the tool's direction"
    )


def _roomiest(
    kinematics: PandaKinematics, p_WT: Sequence[float], distance: float, pitch: float
) -> NDArray[np.float64] | None:
    """The posture [7] with the view leaning by `pitch` that is furthest from the joints' limits; None: none.

    Looked for all around the point, in steps of 15 degrees from where the image's upper edge is away from
    the robot, with the camera on either side of the tool.
    """
    best, best_room = None, 0.0
    for turn in sorted(np.arange(-11, 13) * np.pi / 12, key=abs):
        for lean in (pitch, -pitch):
            q = kinematics.postures(observe_pose(p_WT, distance, kinematics.X_EC, turn, lean))
            room = kinematics.limits.room(q).min(axis=1)
            for i in np.argsort(-room):
                if room[i] < best_room + 1e-6:  # mirrored postures have equal room: the first is taken
                    break
                if kinematics.clearance(q[i]) >= OBSERVING_CLEARANCE:
                    best, best_room = q[i], room[i]
                    break
    return best
