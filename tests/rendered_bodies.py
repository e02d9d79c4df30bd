"""A small rendered world for tests: textured bodies on a white table, moved by hand, never simulated."""

from pathlib import Path

import cv2
import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    LightParameter,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame, sanitize_depth
from riseg_drake.stations.render_engine import make_render_engine

INTRINSICS = Intrinsics(640, 480, 616.285, 615.778, 317.0, 239.0)
LOOKING_DOWN = RotationMatrix(np.diag([1.0, -1.0, -1.0]))


def camera_above(x: float, y: float, height: float, yaw: float = 0.0) -> RigidTransform:
    """X_WC of a camera that looks straight down from (x, y, height), in metres and radians."""
    return RigidTransform(RotationMatrix.MakeZRotation(yaw) @ LOOKING_DOWN, [x, y, height])


def planar_pose(x: float, y: float, z: float, yaw: float = 0.0) -> RigidTransform:
    """X_WB of a body standing on the table."""
    return RigidTransform(RollPitchYaw(0, 0, yaw), [x, y, z])


def write_texture(path: Path, rng: np.random.Generator, size: int = 256) -> None:
    """A patchy texture with detail at several scales."""
    layers = []
    for cell in (64, 16, 6, 3):
        cells = rng.integers(0, 255, (size // cell + 2, size // cell + 2, 3), np.uint8)
        layers.append(cv2.resize(cells, (size, size), interpolation=cv2.INTER_CUBIC).astype(np.float32))
    texture = sum(layers) / len(layers)
    cv2.imwrite(str(path), np.clip(128 + 1.8 * (texture - 128), 20, 235).astype(np.uint8))


def box(*size: float) -> str:
    """SDF geometry of a box."""
    return f"<box><size>{size[0]} {size[1]} {size[2]}</size></box>"


def cylinder(radius: float, length: float) -> str:
    """SDF geometry of a standing cylinder."""
    return f"<cylinder><radius>{radius}</radius><length>{length}</length></cylinder>"


class RenderedBodies:
    """Bodies given as SDF geometries, drawn at any poses from any camera pose.

    All have a texture but those whose index is in `blank`.
    """

    def __init__(self, shapes: list[str], folder: Path, seed: int = 0, blank: tuple[int, ...] = ()) -> None:
        rng = np.random.default_rng(seed)
        builder = DiagramBuilder()
        self.plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
        lights = [LightParameter(type="directional", direction=[0.3, 0.4, -1], frame="world", intensity=0.8)]
        scene_graph.AddRenderer(
            "vtk",
            make_render_engine(RenderEngineVtkParams(lights=lights)),
        )
        table = "<box><size>2 2 0.1</size></box>"
        sdf = _body_sdf("table", table, None, "0 0 -0.05 0 0 0", static=True)
        Parser(self.plant).AddModelsFromString(sdf, "sdf")
        self.bodies = []
        for i, shape in enumerate(shapes):
            texture = None if i in blank else folder / f"texture_{seed}_{i}.png"
            if texture:
                write_texture(texture, rng)
            model = folder / f"body_{seed}_{i}.sdf"
            model.write_text(_body_sdf(f"body_{i}", shape, texture, "0 0 0 0 0 0"))
            (instance,) = Parser(self.plant).AddModels(str(model))
            self.bodies.append(self.plant.get_body(self.plant.GetBodyIndices(instance)[0]))
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.scene_graph = scene_graph
        core = RenderCameraCore(
            "vtk",
            CameraInfo(*INTRINSICS.__dict__.values()),
            ClippingRange(0.01, 5.0),
            RigidTransform(),
        )
        self.color_camera = ColorRenderCamera(core, False)
        self.depth_camera = DepthRenderCamera(core, DepthRange(0.1, 4.0))

    def frame(
        self,
        sequence: int,
        X_WC: RigidTransform,
        X_WBs: list[RigidTransform],
        rng: np.random.Generator | None = None,
    ) -> tuple[Frame, np.ndarray]:
        """The frame seen, and the true labels (1.. for the bodies). `rng` adds sensor noise."""
        plant_context = self.plant.GetMyMutableContextFromRoot(self.context)
        for body, X_WB in zip(self.bodies, X_WBs, strict=True):
            self.plant.SetFreeBodyPose(plant_context, body, X_WB)
        query = self.scene_graph.get_query_output_port().Eval(
            self.scene_graph.GetMyContextFromRoot(self.context)
        )
        world = self.scene_graph.world_frame_id()
        color = query.RenderColorImage(self.color_camera, world, X_WC).data[..., :3].copy()
        depth = sanitize_depth(query.RenderDepthImage(self.depth_camera, world, X_WC).data[..., 0])
        raw = query.RenderLabelImage(self.color_camera, world, X_WC).data[..., 0]
        label = np.zeros(raw.shape, np.uint16)
        for i, body in enumerate(self.bodies):
            label[raw == int(body.index())] = i + 1
        if rng is not None:
            color = np.clip(color + rng.normal(0, 2.0, color.shape), 0, 255).astype(np.uint8)
            sigma = depth**2 * 0.08 / (645 * 0.055)
            noise = cv2.GaussianBlur(rng.normal(0, 1, depth.shape), (0, 0), 1.0) * 3.5
            depth = np.where(depth > 0, np.round((depth + sigma * noise) * 1000) / 1000, 0).astype(np.float32)
        frame = Frame(
            sequence=sequence,
            time=sequence / 15.0,
            intrinsics=INTRINSICS,
            color=color,
            depth=depth,
            X_WC=X_WC.GetAsMatrix4(),
            robot=np.zeros(depth.shape, bool),
        )
        return frame, label


def _body_sdf(name: str, geometry: str, texture: Path | None, pose: str, static: bool = False) -> str:
    texture_tag = f"<drake:diffuse_map>{texture.name}</drake:diffuse_map>" if texture else ""
    color = "1 1 1 1" if texture else "0.9 0.9 0.9 1" if static else "0.5 0.4 0.3 1"
    return f"""<sdf version="1.7"><model name="{name}"><static>{str(static).lower()}</static>
    <link name="{name}"><inertial><mass>0.1</mass></inertial>
    <visual name="v"><pose>{pose}</pose><geometry>{geometry}</geometry>
    <material><diffuse>{color}</diffuse>{texture_tag}</material></visual></link></model></sdf>"""
