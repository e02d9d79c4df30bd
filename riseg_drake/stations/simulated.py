"""A station in simulation: the Panda, its wrist camera, a table and the objects on it."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    HalfSpace,
    IllustrationProperties,
    LightParameter,
    Meshcat,
    MeshcatVisualizer,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    Rgba,
    Role,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame, ModelInstanceIndex, PdControllerGains, RigidBody
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import Demultiplexer, StateInterpolatorWithDiscreteDerivative
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.robot.description import (
    JOINT_NAMES,
    PandaDescription,
    PandaParts,
    add_panda,
    register_models,
)
from riseg_drake.robot.kinematics import OBSERVE_HEIGHTS, OBSERVE_PITCHES, PandaKinematics, observation_posture
from riseg_drake.robot.limits import check_start_position
from riseg_drake.stations.contact import let_touch, set_contact_model
from riseg_drake.stations.footprint import footprint
from riseg_drake.stations.object_models import resolve
from riseg_drake.stations.placed_object import PlacedObject, add_scene, object_id_table
from riseg_drake.stations.placement import check_in_view, check_on_top
from riseg_drake.stations.render_engine import make_render_engine
from riseg_drake.stations.scene import SceneConfig, make_scene
from riseg_drake.stations.sleep import Sleep
from riseg_drake.stations.wrist_camera import CameraConfig, ObjectLabels, WristCamera

RENDERER = "renderer"
PICTURE_DELAY = 2e-4
"""s from the camera's tick, and a step of the plant, to its picture: less than any step, so that joint angles
read before the next one are those of it."""
CLIPPING = (0.01, 10.0)  # m; what the renderer draws, wider than what the sensor measures


def soft_light() -> RenderEngineVtkParams:
    """Two broad lights from above that leave a white table a little below white."""
    lights = [
        LightParameter(type="directional", frame="world", direction=direction, intensity=intensity)
        for direction, intensity in (([-0.5, 0.4, -1.0], 0.5), ([0.6, -0.5, -1.0], 0.45))
    ]
    return RenderEngineVtkParams(lights=lights, default_clear_color=[0.6, 0.62, 0.65])


@dataclass
class TableConfig:
    """The table and its looks."""

    url: str = "package://riseg_drake_models/table/table.sdf"
    """A model of one link, its origin in the middle of the top face."""
    centre_W: list[float] = field(
        default_factory=lambda: [0.45, 0.0], metadata={"sizes": (2,), "least": -5.0, "most": 5.0}
    )
    """Where its middle stands, x and y in W, m."""
    color: list[float] = field(default_factory=list, metadata={"sizes": (0, 3), "least": 0.0, "most": 1.0})
    """Red, green, blue of the top, 0 to 1; empty: as the model says (white)."""
    texture: str = ""
    """A PNG or JPEG file, or a `package://` URL of one, laid over the top; empty: none."""


@dataclass
class SimulatedStationConfig:
    """Everything that a simulated station can be told."""

    panda: PandaDescription = field(default_factory=PandaDescription)
    scene: SceneConfig = field(default_factory=SceneConfig)
    camera: CameraConfig = field(default_factory=CameraConfig)
    table: TableConfig = field(default_factory=TableConfig)
    renderer: RenderEngineVtkParams = field(default_factory=soft_light)
    """Lights, shadows and background of the camera's pictures."""
    time_step: float = field(default=0.002, metadata={"least": 0.0005, "most": 0.02})
    """Longest step of the simulation, s; shortened so that a whole number of steps makes a picture."""
    stiffness: float = field(default=2000.0, metadata={"least": 1.0, "most": 1e6})
    """Proportional gain of every joint's controller, N m / rad."""
    damping: float = field(default=200.0, metadata={"least": 0.0, "most": 1e5})
    """Derivative gain of every joint's controller, N m s / rad."""
    start_position: list[float] = field(default_factory=list, metadata={"sizes": (0, 7)})
    """Joint angles at the start, rad, 7; empty: looking at the middle of the work area."""
    observe_height: float = field(default=0.5, metadata=OBSERVE_HEIGHTS)
    """Distance of the camera from there at the start, m: its height, where it looks straight down. Unused
    where start_position is given."""
    observe_pitch: float = field(default=0.0, metadata=OBSERVE_PITCHES)
    """How far the view leans from straight down at the start, rad (0.785 is 45 degrees), from the side where
    the arm has most room. Unused where start_position is given."""

    def check(self) -> None:
        """Raise ValueError for joint angles that the robot does not have."""
        check_start_position(self.start_position, self.panda.limits)


@dataclass(frozen=True)
class SimulatedWorld:
    """Arm, table and objects in a plant, without anything that looks at them or moves them."""

    plant: MultibodyPlant
    """Finalized."""
    scene_graph: SceneGraph
    panda: PandaParts
    objects: list[PlacedObject]
    """As they were placed; object id i + 1 is `objects[i]`."""
    object_bodies: dict[int, BodyIndex]
    """Index of the body of each object id."""


def add_world(
    builder: DiagramBuilder,
    config: SimulatedStationConfig,
    seed: int,
    step: float,
    objects: Sequence[PlacedObject] | None = None,
) -> SimulatedWorld:
    """Add the plant of a station to a diagram, the arm in its start position; `step` in s.

    `objects` replaces the scene that `config.scene` would draw from the seed. Raises ValueError.
    """
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, step)
    panda = add_panda(plant, config.panda, config.camera.fixed_pose)
    for body in plant.GetBodyIndices(panda.tool):
        pushing = plant.GetCollisionGeometriesForBody(plant.get_body(body))
        let_touch(plant, scene_graph, pushing, rigid=True)
    for instance in (panda.arm, panda.tool):
        plant.set_gravity_enabled(instance, False)
    table = _add_table(plant, scene_graph, config.table)
    by_hand = objects is None and config.scene.placed
    if objects is None:
        objects = make_scene(config.scene, np.random.default_rng(seed))
    object_bodies = add_scene(plant, scene_graph, objects)
    set_contact_model(plant, any(item.model.over_areas for item in objects))
    _set_gains(plant, panda.arm, config)
    plant.Finalize()
    plant.SetDefaultPositions(panda.arm, start_position(config))
    if by_hand:
        geometries = plant.GetCollisionGeometriesForBody(table)
        X_WT = RigidTransform([*config.table.centre_W, 0.0])
        inspector = scene_graph.model_inspector()
        if geometries and not any(isinstance(inspector.GetShape(g), HalfSpace) for g in geometries):
            check_on_top(objects, footprint(inspector, geometries, X_WT))  # else it has no edge
        if panda.camera_frame is not None:
            X_WC = panda.camera_frame.CalcPoseInWorld(plant.CreateDefaultContext())
            check_in_view(objects, X_WC, config.camera.intrinsics)
    return SimulatedWorld(plant, scene_graph, panda, list(objects), object_bodies)


def ideal_camera(plant: MultibodyPlant, frame: Frame, config: CameraConfig) -> RgbdSensor:
    """A camera at a frame of a plant that sees without noise; it needs the renderer RENDERER.

    It is mounted as wrongly as the config says.
    """
    k = config
    X_CM = exp_se3(np.concatenate([k.mount_turn, k.mount_shift]))
    core = RenderCameraCore(
        RENDERER,
        CameraInfo(k.width, k.height, k.fx, k.fy, k.cx, k.cy),
        ClippingRange(*CLIPPING),
        RigidTransform(),
    )
    return RgbdSensor(
        plant.GetBodyFrameIdOrThrow(frame.body().index()),
        frame.GetFixedPoseInBodyFrame() @ RigidTransform(X_CM),
        ColorRenderCamera(core),
        DepthRenderCamera(core, DepthRange(*CLIPPING)),
    )


class SimulatedStation(Diagram):
    """The ports of `contract.py`, and the ground truth as `cheat.*`.

    Ground truth: `cheat.label_image` (ImageLabel16I, object ids 1..N, all else 0) shows the latest state
    and is drawn only when pulled; `cheat.color_image` likewise, without noise; `cheat.body_poses`
    (poses X_WB of all bodies of `plant`, by body index).

    `objects` replaces the scene that `config.scene` would draw. Raises ValueError (SceneError for an
    impossible scene) for settings that cannot be.
    """

    def __init__(
        self,
        config: SimulatedStationConfig,
        seed: int = 0,
        *,
        objects: Sequence[PlacedObject] | None = None,
        meshcat: Meshcat | None = None,
    ):
        super().__init__()
        steps_a_picture = int(np.ceil(1 / (config.camera.rate * config.time_step) - 1e-9))
        step = 1 / (config.camera.rate * steps_a_picture)
        builder = DiagramBuilder()
        world = add_world(builder, config, seed, step, objects)
        plant, scene_graph, panda = world.plant, world.scene_graph, world.panda
        self.objects = world.objects
        """The scene as it was at the start; object id i + 1 is `objects[i]`."""
        self.object_bodies = world.object_bodies
        """Index of the body of each object id."""
        self.plant = plant
        self.scene_graph = scene_graph
        robot, bodies = (panda.arm, panda.tool), list(world.object_bodies.values())
        self.sleep = Sleep(plant, scene_graph, robot, bodies, 1 / config.camera.rate)
        """Asked once a picture, what lies still costs next to nothing."""

        self._wire_arm(builder, panda.arm, step)
        scene_graph.AddRenderer(RENDERER, make_render_engine(config.renderer))
        self._wire_camera(builder, panda.camera_frame, config.camera, seed)
        builder.ExportOutput(plant.get_body_poses_output_port(), "cheat.body_poses")
        if meshcat is not None:
            MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
        builder.BuildInto(self)
        self.set_name("station")

    def _wire_arm(self, builder: DiagramBuilder, arm: ModelInstanceIndex, step: float) -> None:
        """Commands go in with their rate of change as desired velocity, so that the arm does not lag."""
        reference = builder.AddNamedSystem("reference", StateInterpolatorWithDiscreteDerivative(7, step))
        split = builder.AddNamedSystem("measured", Demultiplexer([7, 7]))
        builder.Connect(reference.get_output_port(), self.plant.get_desired_state_input_port(arm))
        builder.Connect(self.plant.get_state_output_port(arm), split.get_input_port())
        builder.ExportInput(reference.get_input_port(), "panda.position")
        builder.ExportOutput(split.get_output_port(0), "panda.position_measured")
        builder.ExportOutput(split.get_output_port(1), "panda.velocity_measured")

    def _wire_camera(self, builder: DiagramBuilder, frame: Frame, config: CameraConfig, seed: int) -> None:
        k = config
        sensor = builder.AddNamedSystem("ideal_camera", ideal_camera(self.plant, frame, k))
        camera = builder.AddNamedSystem("wrist_camera", WristCamera(k, seed, 1 / k.rate, PICTURE_DELAY))
        labels = builder.AddNamedSystem("labels", ObjectLabels(k, object_id_table(self.object_bodies)))
        builder.Connect(self.scene_graph.get_query_output_port(), sensor.query_object_input_port())
        builder.Connect(sensor.color_image_output_port(), camera.GetInputPort("color_image"))
        builder.Connect(sensor.depth_image_32F_output_port(), camera.GetInputPort("depth_image"))
        builder.Connect(sensor.body_pose_in_world_output_port(), camera.GetInputPort("camera_pose"))
        builder.Connect(sensor.label_image_output_port(), labels.get_input_port())
        for name in ("color_image", "depth_image", "image_time"):
            builder.ExportOutput(camera.GetOutputPort(name), f"wrist.{name}")
        builder.ExportOutput(sensor.color_image_output_port(), "cheat.color_image")
        builder.ExportOutput(labels.get_output_port(), "cheat.label_image")


def start_position(config: SimulatedStationConfig) -> list[float]:
    """Joint angles at the start, rad [7]. Raises ValueError where the arm cannot look from there."""
    return list(
        observation_posture(
            PandaKinematics(config.panda, config.camera.fixed_pose),
            config.scene.centre_W,
            config.observe_height,
            config.start_position,
            config.observe_pitch,
        )
    )


def _set_gains(plant: MultibodyPlant, arm: ModelInstanceIndex, config: SimulatedStationConfig) -> None:
    for name in JOINT_NAMES:
        joint = plant.GetJointByName(name, arm)
        for index in plant.GetJointActuatorIndices():
            actuator = plant.get_joint_actuator(index)
            if actuator.joint().index() == joint.index():
                actuator.set_controller_gains(PdControllerGains(p=config.stiffness, d=config.damping))


def _add_table(plant: MultibodyPlant, scene_graph: SceneGraph, config: TableConfig) -> RigidBody:
    """Add the table with its looks; returns its body."""
    parser = Parser(plant)
    register_models(parser)
    (table,) = parser.AddModels(url=config.url)
    (body_index,) = plant.GetBodyIndices(table)
    body = plant.get_body(body_index)
    plant.WeldFrames(plant.world_frame(), body.body_frame(), RigidTransform([*config.centre_W, 0.0]))
    let_touch(plant, scene_graph, plant.GetCollisionGeometriesForBody(body), rigid=True)
    if not config.color and not config.texture:
        return body
    texture = resolve(config.texture) if config.texture else None
    if texture is not None and not texture.is_file():
        raise ValueError(f"table texture: no file {config.texture}; expected a PNG or JPEG image")
    source = plant.get_source_id()
    for geometry in plant.GetVisualGeometriesForBody(body):
        old = scene_graph.model_inspector().GetPerceptionProperties(geometry)
        looks = PerceptionProperties()
        looks.AddProperty("label", "id", old.GetProperty("label", "id"))
        looks.AddProperty("phong", "diffuse", Rgba(*(config.color or [1.0, 1.0, 1.0])))
        # Taken off and put on again, since what cameras see cannot be replaced in one go.
        for role in (Role.kPerception, Role.kIllustration):
            scene_graph.RemoveRole(source, geometry, role)
        # Meshcat draws no texture on a box: it shows the colour alone.
        scene_graph.AssignRole(source, geometry, IllustrationProperties(looks))
        if texture is not None:
            looks.AddProperty("phong", "diffuse_map", str(texture))
        scene_graph.AssignRole(source, geometry, looks)
    return body
