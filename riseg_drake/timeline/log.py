"""Moments into a Rerun recording: an entity for each thing that can be looked at.

camera                       X_WC
camera/image                 the pinhole, with color, depth (m) and mask below it
flow/optical, flow/expected  as colour, at half the size
body_frames                  where they are, and what their twists do to them, by group
twists/group_0/omega, v      of each group, rad and m per pair
objects/object_3             the points of an id, in its colour
push                         the contact's way
robot/...                    the robot's shapes
scores/..., stages/..., confidence/object_3
"""

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.geometry.camera import back_project
from riseg_drake.geometry.rgbd import NO_PAIR, Frame, FramePair
from riseg_drake.geometry.se3 import adjoint, inverse, log_se3, move_points, translation
from riseg_drake.pictures.flow import flow_colors
from riseg_drake.pictures.object_colors import object_colors
from riseg_drake.pushing.push import NO_PUSH, Push
from riseg_drake.segmentation.motions import BFIFGroups
from riseg_drake.segmentation.segmentation import Segmentation
from riseg_drake.timeline.blueprint import TIME
from riseg_drake.timeline.moment import Moment
from riseg_drake.timeline.robot_shapes import RobotShapes

_QUALITY = 85
"""Of JPEG."""
_LONGEST_FLOW = 6.0
"""Pixels of flow that have the full colour; a pair spans 2 to 5."""
_POINTS = 4000
"""About so many points of an object are shown."""
_FRUSTUM = 0.12
"""How far before the camera its picture stands, m."""
_UNGROUPED = (150, 150, 150)
_ROBOT = (175, 178, 182)
_PUSH = (214, 94, 0)


class TimelineLog:
    """Writes moments to a `rerun.RecordingStream`. It never raises for what the stream cannot take."""

    def __init__(self, stream: Any, robot: RobotShapes | None = None):
        import rerun

        self._rerun, self._stream, self._robot = rerun, stream, robot
        self._start: float | None = None
        self._named: tuple[int, ...] = ()
        self._shown: set[int] = set()
        self._groups = 0
        stream.log("/", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for piece in robot.pieces if robot else ():
            mesh = rerun.Mesh3D(
                vertex_positions=piece.corners.astype(np.float32),
                triangle_indices=piece.triangles,
                albedo_factor=_ROBOT,
            )
            stream.log(f"robot/{piece.body}/{piece.name}", mesh, static=True)

    def take(self, moment: Moment) -> None:
        """Log one frame; nothing before the first."""
        if moment.pair is NO_PAIR:
            return
        frame = moment.pair.current
        if self._start is None:
            self._start = frame.time
        self._stream.set_time(TIME, duration=frame.time - self._start)
        self._name(moment.segmentation.object_ids)
        self._log_camera(frame, moment.segmentation.mask)
        self._log_picture("flow/optical", _flow_picture(moment.optical_flow))
        self._log_picture("flow/expected", _flow_picture(moment.expected_flow))
        self._log_groups(moment.pair, moment.groups)
        self._log_objects(frame, moment.segmentation)
        self._log_push(moment.push)
        if self._robot is not None and moment.position is not None:
            for name, X_WB in self._robot.poses(moment.position).items():
                self._stream.log(f"robot/{name}", self._pose(X_WB))
        self._log_numbers("stages", moment.stage_ms)
        self._log_numbers("scores", moment.scores)

    def take_scores(self, time: float, scores: Mapping[str, float]) -> None:
        """Log scores, percent, by the name of the figure, of the frame that was taken at `time`, s."""
        if self._start is not None:
            self._stream.set_time(TIME, duration=time - self._start)
            self._log_numbers("scores", scores)

    def _name(self, ids: tuple[int, ...]) -> None:
        """Give ids a name and the colour that they have in all pictures."""
        if ids == self._named:
            return
        self._named = ids
        known = [(a, f"object {a}", tuple(int(x) for x in object_colors(np.array(a)))) for a in ids]
        self._stream.log("/", self._rerun.AnnotationContext([(0, "background", (0, 0, 0, 0)), *known]))

    def _log_camera(self, frame: Frame, mask: NDArray[np.uint16]) -> None:
        k, rerun = frame.intrinsics, self._rerun
        self._stream.log("camera", self._pose(frame.X_WC))
        pinhole = rerun.Pinhole(
            focal_length=(k.fx, k.fy),
            principal_point=(k.cx + 0.5, k.cy + 0.5),  # Rerun counts from the corner of the first pixel
            resolution=(k.width, k.height),
            camera_xyz=rerun.ViewCoordinates.RDF,
            image_plane_distance=_FRUSTUM,
        )
        self._stream.log("camera/image", pinhole)
        self._log_picture("camera/image/color", frame.color)
        millimetres = np.round(1e3 * np.clip(frame.depth, 0, 65.0)).astype(np.uint16)
        depth = cv2.imencode(".png", millimetres)[1].tobytes()
        self._stream.log(
            "camera/image/depth", rerun.EncodedDepthImage(blob=depth, media_type="image/png", meter=1000.0)
        )
        self._stream.log("camera/image/mask", rerun.SegmentationImage(mask))

    def _log_picture(self, path: str, picture: NDArray[np.uint8]) -> None:
        self._stream.log(path, self._rerun.Image(picture).compress(jpeg_quality=_QUALITY))

    def _log_groups(self, pair: FramePair, groups: BFIFGroups) -> None:
        rerun = self._rerun
        R_WC0 = pair.reference.X_WC[:3, :3]
        from_S = groups.p_C0Q - groups.p_C0S
        moved = np.cross(groups.V_S[:, :3], from_S) + groups.V_S[:, 3:]
        color = np.where(
            groups.group[:, None] >= 0, object_colors(groups.group + 1), np.array(_UNGROUPED, np.uint8)
        )
        arrows = rerun.Arrows3D(
            origins=move_points(pair.reference.X_WC, groups.p_C0Q), vectors=moved @ R_WC0.T, colors=color
        )
        self._stream.log("body_frames", arrows)
        for g in range(max(len(groups), self._groups)):
            V_S = group_twist(groups, g) if g < len(groups) else np.full(6, np.nan)
            self._stream.log(f"twists/group_{g}/omega", rerun.Scalars(V_S[:3]))
            self._stream.log(f"twists/group_{g}/v", rerun.Scalars(V_S[3:]))
        self._groups = len(groups)

    def _log_objects(self, frame: Frame, segmentation: Segmentation) -> None:
        rerun, mask = self._rerun, segmentation.mask
        p_WQ = move_points(frame.X_WC, back_project(frame.depth, frame.intrinsics).astype(float))
        for a in np.unique(mask[mask > 0]).tolist():
            points = p_WQ[(mask == a) & (frame.depth > 0)]
            points = points[:: max(1, len(points) // _POINTS)]
            cloud = rerun.Points3D(points, colors=object_colors(np.array(a)), radii=0.0015)
            self._stream.log(f"objects/object_{a}", cloud)
            self._shown.add(a)
        for a in self._shown - set(segmentation.object_ids):
            self._stream.log(f"objects/object_{a}", rerun.Clear(recursive=False))
        self._shown &= set(segmentation.object_ids)
        self._log_numbers("confidence", {f"object_{a}": c for a, c in segmentation.confidence.items()})

    def _log_push(self, push: Push) -> None:
        if push is NO_PUSH:
            self._stream.log("push", self._rerun.Clear(recursive=False))
            return
        way = push.d_push * np.array([*push.direction_W, 0.0])
        arrow = self._rerun.Arrows3D(origins=[push.p_WB], vectors=[way], colors=[_PUSH], radii=[0.004])
        self._stream.log("push", arrow)

    def _log_numbers(self, path: str, numbers: Mapping[str, float]) -> None:
        for name, number in numbers.items():
            self._stream.log([path, name], self._rerun.Scalars(number))

    def _pose(self, X_WF: NDArray) -> Any:
        return self._rerun.Transform3D(translation=X_WF[:3, 3], mat3x3=X_WF[:3, :3])


def group_twist(groups: BFIFGroups, g: int) -> NDArray[np.float64]:
    """V_S [6] = [omega; v] of a group's motion, radian and metre per pair.

    The space frame {s} is that of its body frames: the axes of C0, the origin at p_C0S.
    """
    X_SC0 = inverse(translation(groups.p_C0S))
    return adjoint(X_SC0) @ log_se3(groups.motion_C0[g])


def _flow_picture(flow: NDArray) -> NDArray[np.uint8]:
    return flow_colors(np.asarray(flow)[::2, ::2], _LONGEST_FLOW)
