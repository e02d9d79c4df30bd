"""Which shapes touch over areas, and with what numbers; asked of Drake's own properties."""

from unittest.mock import Mock

import pytest
from pydrake.geometry import Box, Mesh, ProximityProperties, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import ContactModel, CoulombFriction, DiscreteContactApproximation, MultibodyPlant

from riseg_drake.stations.contact import let_touch, set_contact_model, touches_over_area

CUBE = "\n".join(
    [
        *(f"v {x} {y} {z}" for z in (0, 1) for y in (0, 1) for x in (0, 1)),
        *("f 1 3 4 2", "f 5 6 8 7", "f 1 2 6 5", "f 3 7 8 4", "f 1 5 7 3", "f 2 4 8 6"),
    ]
)


class Shapes:
    """A plant with one shape at a time on the world."""

    def __init__(self):
        self.graph = SceneGraph()
        self.plant = MultibodyPlant(0.002)
        self.plant.RegisterAsSourceForSceneGraph(self.graph)
        self.inspector = self.graph.model_inspector()

    def shape(self, properties=None, shape=None):
        said = properties or CoulombFriction(0.7, 0.6)
        name = f"shape{self.plant.num_collision_geometries()}"
        world = self.plant.world_body()
        return self.plant.RegisterCollisionGeometry(
            world, RigidTransform(), shape or Box(0.1, 0.1, 0.1), name, said
        )

    def touched(self, geometry, **kind):
        let_touch(self.plant, self.graph, [geometry], **kind)
        return self.inspector.GetProximityProperties(geometry)


@pytest.fixture
def shapes():
    return Shapes()


def properties(**said):
    result = ProximityProperties()
    result.AddProperty("material", "coulomb_friction", CoulombFriction(0.7, 0.6))
    for name, value in said.items():
        group, _, key = name.partition("__")
        result.AddProperty(group, key, value)
    return result


def test_over_areas_the_plant_takes_hydroelastic_contact_and_holds_on_slopes():
    plant = Mock(wraps=MultibodyPlant(0.002))
    set_contact_model(plant, over_areas=True)
    assert plant.get_contact_model() == ContactModel.kHydroelasticWithFallback
    assert plant.get_discrete_contact_approximation() == DiscreteContactApproximation.kSimilar
    plant.set_stiction_tolerance.assert_called_once_with(1e-5)


def test_at_points_the_plant_takes_the_lagged_approximation():
    plant = MultibodyPlant(0.002)
    set_contact_model(plant, over_areas=False)
    assert plant.get_contact_model() == ContactModel.kPoint
    assert plant.get_discrete_contact_approximation() == DiscreteContactApproximation.kLagged


def test_a_shape_whose_model_says_nothing_touches_over_its_area(shapes):
    assert touches_over_area(shapes.inspector, shapes.shape())


def test_a_stiffness_of_points_is_taken_at_its_word_and_changed_in_nothing(shapes):
    geometry = shapes.shape(properties(material__point_contact_stiffness=1e4))
    assert not touches_over_area(shapes.inspector, geometry)
    assert not shapes.touched(geometry).HasGroup("hydroelastic")


def test_a_mesh_touches_at_points_unless_its_model_says_otherwise(shapes, tmp_path):
    (tmp_path / "cube.obj").write_text(CUBE)
    mesh = Mesh(str(tmp_path / "cube.obj"))
    plain = shapes.shape(shape=mesh)
    assert not touches_over_area(shapes.inspector, plain)
    assert not shapes.touched(plain).HasGroup("hydroelastic")
    said = shapes.shape(properties(hydroelastic__hydroelastic_modulus=2e5), mesh)
    assert touches_over_area(shapes.inspector, said)


def test_what_is_pushed_is_soft_rubber_that_does_not_bounce(shapes):
    said = shapes.touched(shapes.shape())
    assert said.GetProperty("hydroelastic", "hydroelastic_modulus") == 1e6
    assert said.GetProperty("hydroelastic", "resolution_hint") == 0.02
    assert said.GetProperty("material", "hunt_crossley_dissipation") == 500.0
    friction = said.GetProperty("material", "coulomb_friction")
    assert (friction.static_friction(), friction.dynamic_friction()) == (0.7, 0.6)


def test_what_things_stand_on_is_rigid(shapes):
    said = shapes.touched(shapes.shape(), rigid=True)
    assert said.HasGroup("hydroelastic")
    assert not said.HasProperty("hydroelastic", "hydroelastic_modulus")
    assert said.GetProperty("hydroelastic", "resolution_hint") == 0.02
    assert not said.HasProperty("material", "hunt_crossley_dissipation")


def test_the_dissipation_and_the_modulus_of_a_model_are_kept(shapes):
    own = shapes.touched(shapes.shape(properties(material__hunt_crossley_dissipation=3.0)))
    assert own.GetProperty("material", "hunt_crossley_dissipation") == 3.0
    assert own.GetProperty("hydroelastic", "hydroelastic_modulus") == 1e6
    soft = shapes.touched(shapes.shape(properties(hydroelastic__hydroelastic_modulus=2e5)))
    assert soft.GetProperty("hydroelastic", "hydroelastic_modulus") == 2e5
    assert not soft.HasProperty("material", "hunt_crossley_dissipation")


def test_of_several_shapes_those_after_one_that_is_left_alone_are_seen_to(shapes):
    left, right = shapes.shape(properties(material__point_contact_stiffness=1e4)), shapes.shape()
    let_touch(shapes.plant, shapes.graph, [left, right])
    assert shapes.inspector.GetProximityProperties(right).HasGroup("hydroelastic")
