import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex

from riseg_drake.stations.object_models import find_model
from riseg_drake.stations.placed_object import PlacedObject, add_scene, object_id_table

BOX = "<geometry><box><size>0.04 0.06 0.02</size></box></geometry>"


@pytest.fixture
def box(tmp_path):
    (tmp_path / "brick.sdf").write_text(
        "<sdf version='1.6'><model name='brick'><link name='link'><inertial><mass>0.2</mass></inertial>"
        f"<visual name='v'>{BOX}</visual><collision name='c'>{BOX}</collision></link></model></sdf>"
    )
    return find_model(str(tmp_path / "brick.sdf"))


def test_ids_count_from_one_in_the_order_of_the_objects_and_each_stands_where_it_is_put(box):
    poses = [RigidTransform(RollPitchYaw(0.1, -0.2, k), [0.1 * k, 0.2, 0.3]) for k in (1.0, 2.0, 3.0)]
    placed = [PlacedObject(box, X_WB) for X_WB in poses]
    graph, plant = SceneGraph(), MultibodyPlant(0.002)
    plant.RegisterAsSourceForSceneGraph(graph)
    bodies = add_scene(plant, graph, placed)
    for body in bodies.values():
        for geometry in plant.GetCollisionGeometriesForBody(plant.get_body(body)):
            assert graph.model_inspector().GetProximityProperties(geometry).HasGroup("hydroelastic")
    plant.Finalize()
    assert list(bodies) == [1, 2, 3]
    assert [int(index) for index in bodies.values()] == [1, 2, 3]  # 0 is the world
    context = plant.CreateDefaultContext()
    for body, X_WB in zip(bodies.values(), poses, strict=True):
        assert plant.EvalBodyPoseInWorld(context, plant.get_body(body)).IsNearlyEqualTo(X_WB, 1e-12)


def test_an_object_is_called_as_its_model_is(box):
    placed = PlacedObject(box, RigidTransform())
    assert (placed.name, placed.model_path) == ("brick", box.path)


def test_the_table_of_labels_knows_the_objects_and_calls_all_else_background():
    table = object_id_table({1: BodyIndex(9), 2: BodyIndex(4)})
    assert table.shape == (32768,)
    assert {int(label): int(table[label]) for label in np.flatnonzero(table)} == {9: 1, 4: 2}
    assert table[np.iinfo(np.int16).max] == 0
