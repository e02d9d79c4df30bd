import re
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from pydrake.geometry import Box, SurfaceTriangle, TriangleSurfaceMesh
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
    MultibodyPlant,
)
from pydrake.multibody.tree import (
    CalcSpatialInertia,
    PdControllerGains,
    PrismaticJoint,
    SpatialInertia,
    default_model_instance,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial
from riseg_drake.models.objects.make_objects import make_toy
from riseg_drake.models.objects.toys import TOYS

from riseg_drake.stations.footprint import Footprint, travel
from riseg_drake.stations.object_models import ObjectModel, parse_body, resolve

MODELS = "package://riseg_drake_models/objects"
FOLDER = resolve(MODELS)
named = pytest.mark.parametrize("model", sorted(path.stem for path in FOLDER.glob("*/*.sdf")), indirect=True)


@cache
def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices [n, 3] and triangles [m, 3] of an OBJ file."""
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([[float(x) for x in line[1:]] for line in lines if line[0] == "v"])
    faces = np.array([[int(c.split("/")[0]) - 1 for c in line[1:]] for line in lines if line[0] == "f"])
    return vertices, faces


def mesh(model: ObjectModel) -> tuple[np.ndarray, np.ndarray]:
    """Vertices [n, 3] and triangles [m, 3] of what is seen of a toy."""
    return read_obj(model.path.with_suffix(".obj"))


def outline_area(footprint: Footprint) -> tuple[float, float]:
    """Area of a footprint and of its convex hull, in pixels of a quarter of a millimetre."""
    corners = [np.round(piece * 4000).astype(np.int32) + 400 for piece in footprint.pieces]
    canvas = np.zeros((800, 800), np.uint8)
    for piece in corners:
        cv2.fillConvexPoly(canvas, piece, 1)
    return float(canvas.sum()), cv2.contourArea(cv2.convexHull(np.vstack(corners)))


def test_there_are_many_kinds_of_toys(models):
    heights = [np.ptp(mesh(model)[0][:, 2]) for model in models.values()]
    lengths = [np.ptp(model.footprint.corners(), axis=0).max() for model in models.values()]
    filled = [area / hull for area, hull in (outline_area(model.footprint) for model in models.values())]
    assert len(models) >= 14
    assert sum(height < 0.016 for height in heights) >= 2, "low ones"
    assert max(heights) > 0.040
    assert max(heights) < 0.051
    assert min(lengths) > 0.04
    assert max(lengths) < 0.115
    assert sum(share < 0.9 for share in filled) >= 4, "silhouettes that are not convex"


def test_the_whole_collection_is_light_enough_to_ship(models):
    assert sum(path.stat().st_size for path in FOLDER.rglob("*.*") if path.suffix != ".pyc") < 4e6
    for model in models.values():
        assert len(mesh(model)[1]) < 3000
        assert max(cv2.imread(str(model.path.with_suffix(".png"))).shape) <= 512


def test_toys_look_alike_in_colour_and_varied_within(models):
    images = {m.name: cv2.imread(str(m.path.with_suffix(".png"))).astype(float) for m in models.values()}
    spread = {name: image.std(axis=(0, 1)).mean() for name, image in images.items()}
    assert sum(value < 15 for value in spread.values()) in (1, 2), "a plain one or two"
    within = np.median(list(spread.values()))
    across = np.std([image.mean(axis=(0, 1)) for image in images.values()], axis=0).mean()
    assert within > across


@named
def test_mass_and_inertia_are_those_of_the_solid_inside_the_mesh(model):
    vertices, faces = mesh(model)
    surface = TriangleSurfaceMesh([SurfaceTriangle(*map(int, face)) for face in faces], list(vertices))
    plant = MultibodyPlant(0.0)
    body = parse_body(plant, model.path)
    inertia = body.default_spatial_inertia()
    volume = CalcSpatialInertia(surface, 1.0).get_mass()
    expected = CalcSpatialInertia(surface, inertia.get_mass() / volume)
    assert inertia.IsPhysicallyValid()
    assert 0.040 < inertia.get_mass() < 0.2
    assert 299.5 < inertia.get_mass() / volume < 900.5  # wood to solid rubber; the files are rounded
    np.testing.assert_allclose(inertia.get_com(), expected.get_com(), atol=5e-5)
    scale = np.trace(expected.CopyToFullMatrix6()[:3, :3])
    np.testing.assert_allclose(
        inertia.CopyToFullMatrix6()[:3, :3], expected.CopyToFullMatrix6()[:3, :3], atol=2e-3 * scale
    )


@named
def test_the_mesh_is_closed(model):
    _, faces = mesh(model)
    edges = [tuple(edge) for k in range(3) for edge in faces[:, [k, (k + 1) % 3]]]
    assert len(set(edges)) == len(edges)
    assert {edge[::-1] for edge in edges} == set(edges)


@named
def test_collision_pieces_follow_the_solid_and_only_feet_reach_the_table(model):
    vertices, _ = mesh(model)
    pieces = [read_obj(path)[0] for path in sorted(model.path.parent.glob("*_piece_*.obj"))]
    corners = np.vstack(pieces)
    assert corners[:, 2].min() == pytest.approx(0.0007, abs=1e-5)
    assert np.all(corners.min(axis=0)[:2] > vertices.min(axis=0)[:2] - 0.0015)
    assert np.all(corners.max(axis=0) < vertices.max(axis=0) + 0.0015)
    assert np.all(np.ptp(corners, axis=0)[:2] > np.ptp(vertices, axis=0)[:2] - 0.002)
    assert model.footprint.bottom == pytest.approx(0.0, abs=1e-5)
    assert not model.over_areas, "a toy stands on feet of its own, and touches at points"
    feet = re.findall(r'name="foot_\d+">\s*<pose>(\S+) (\S+)', model.path.read_text())
    hull = cv2.convexHull(np.array(feet, np.float32))
    assert cv2.pointPolygonTest(hull, (0.0, 0.0), True) > 0.004, "the centre of mass is well between the feet"


@pytest.mark.renders
@pytest.mark.parametrize("toy", TOYS, ids=lambda toy: toy.name)
def test_the_program_draws_the_same_files_again(toy, tmp_path):
    make_toy(toy, tmp_path)
    shipped = {path.name: path for path in (FOLDER / toy.name).iterdir()}
    assert set(shipped) == {path.name for path in tmp_path.iterdir()}
    for path in tmp_path.iterdir():
        if path.suffix == ".png":  # the same picture; its bytes depend on the compressor in OpenCV
            assert np.array_equal(cv2.imread(str(path)), cv2.imread(str(shipped[path.name])))
        else:
            assert path.read_bytes() == shipped[path.name].read_bytes()


class PushingBench:
    """Every toy on its own lane of a table, each with a bar that pushes it by 2 cm at 2 cm/s along x."""

    start, length, speed, lead = 2.0, 0.02, 0.02, 0.002

    def __init__(self, models):
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, 0.002)
        plant.set_contact_model(ContactModel.kPoint)
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)
        plant.RegisterCollisionGeometry(
            plant.world_body(),
            RigidTransform([0, 0, -0.1]),
            Box(2, 6, 0.2),
            "table",
            CoulombFriction(0.5, 0.5),
        )
        self.plant, self.bodies, home = plant, [], []
        tip = Footprint((np.array([[-0.01, -0.015], [0.01, -0.015], [0.01, 0.015], [-0.01, 0.015]]),), 0.0)
        ahead = np.array([1.0, 0.0])
        for k, model in enumerate(models):
            y = 0.2 * k - 1.6
            body = parse_body(plant, model.path)
            plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform([0, y, 0]))
            self.bodies.append(body)
            bar = plant.AddRigidBody(
                f"bar_{k}",
                default_model_instance(),
                SpatialInertia.SolidBoxWithMass(2.0, 0.02, 0.03, 0.1),
            )
            plant.RegisterCollisionGeometry(
                bar,
                RigidTransform([0, y, 0.058]),
                Box(0.02, 0.03, 0.1),
                f"bar_{k}",
                CoulombFriction(0.4, 0.4),
            )
            joint = plant.AddJoint(PrismaticJoint(f"bar_{k}", plant.world_frame(), bar.body_frame(), [1, 0, 0]))
            home.append(travel(tip.moved(0.0, [-0.3, 0]), model.footprint, ahead) - 0.3 - self.lead)
            joint.set_default_translation(home[-1])
            actuator = plant.AddJointActuator(f"bar_{k}", joint, 1e3)
            actuator.set_controller_gains(PdControllerGains(p=2e4, d=2e3))
        plant.Finalize()
        self.stop = self.start + (self.length + self.lead) / self.speed
        way = np.array(home)[:, None] + np.array([[0.0, 0.0, 1.0, 1.0]]) * (self.length + self.lead)
        path = PiecewisePolynomial.FirstOrderHold([0.0, self.start, self.stop, 10.0], way)
        source = builder.AddSystem(TrajectorySource(path, 1))
        builder.Connect(source.get_output_port(), plant.get_desired_state_input_port(default_model_instance()))
        self.simulator = Simulator(builder.Build())
        self.context = plant.GetMyContextFromRoot(self.simulator.get_context())

    def poses(self, time: float) -> list[RigidTransform]:
        self.simulator.AdvanceTo(time)
        return [body.EvalPoseInWorld(self.context) for body in self.bodies]


def moved(before: RigidTransform, after: RigidTransform) -> tuple[np.ndarray, float, float]:
    """Translation [3] (m), rotation and tilt (rad) between two poses."""
    R: RotationMatrix = after.rotation().multiply(before.rotation().inverse())
    tilt = np.arccos(np.clip(R.matrix()[2, 2], -1.0, 1.0))
    return after.translation() - before.translation(), R.ToAngleAxis().angle(), tilt


@pytest.mark.renders
def test_toys_rest_still_slide_upright_when_pushed_and_stop(models):
    bench = PushingBench(models.values())
    placed = bench.poses(0.0)
    rested = bench.poses(bench.start)
    during = [bench.poses(t) for t in np.linspace(bench.start, bench.stop, 12)]
    pushed = during[-1]
    let_go = bench.poses(bench.stop + 0.5)  # the bar's own lag runs out
    after = bench.poses(bench.stop + 1.0)
    degree = np.pi / 180
    for k, model in enumerate(models.values()):
        shift, turn, _ = moved(placed[k], rested[k])
        assert np.linalg.norm(shift) < 2e-4, f"{model.name} creeps at rest"
        assert turn < 0.2 * degree, f"{model.name} turns at rest"
        assert max(moved(rested[k], poses[k])[2] for poses in during) < 3 * degree, f"{model.name} topples"
        shift, turn, _ = moved(rested[k], pushed[k])
        # Pushed beside its centre of mass a toy turns, and the centre goes less far than the bar.
        assert 0.016 < shift[0] < 0.021, f"{model.name} does not slide along"
        assert turn < 15 * degree, model.name
        assert np.linalg.norm(moved(pushed[k], after[k])[0]) < 3e-4, f"{model.name} does not stop"
        assert np.linalg.norm(moved(let_go[k], after[k])[0]) < 2e-5, f"{model.name} glides on"
