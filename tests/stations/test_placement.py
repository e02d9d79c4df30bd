"""What a person placed is refused where it cannot be, with its number, by how much, and what would be right."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.stations.footprint import Footprint
from riseg_drake.stations.object_models import SceneError, find_model
from riseg_drake.stations.placed_object import PlacedObject
from riseg_drake.stations.placement import check_apart, check_in_view, check_on_top
from riseg_drake.stations.scene import PlacedConfig, SceneConfig
from riseg_drake.stations.simulated import SimulatedStation, SimulatedStationConfig

SDF = """<sdf version="1.9"><model name="m"><link name="b">
  <inertial><mass>0.1</mass><inertia><ixx>6e-5</ixx><iyy>6e-5</iyy><izz>7e-5</izz></inertia></inertial>
  <visual name="v"><geometry><box><size>0.06 0.04 0.02</size></box></geometry></visual>
  {collisions}</link></model></sdf>"""
PIECE = """<collision name="c{k}"><pose>{pose} 0 0 0</pose>
  <geometry><box><size>{size}</size></box></geometry></collision>"""


def model(folder, name, *pieces):
    text = "".join(PIECE.format(k=k, pose=pose, size=size) for k, (pose, size) in enumerate(pieces))
    (folder / f"{name}.sdf").write_text(SDF.format(collisions=text))
    return find_model(str(folder / f"{name}.sdf"))


@pytest.fixture
def brick(tmp_path):
    return model(tmp_path, "brick", ("0 0 0.01", "0.06 0.04 0.02"))


def at(thing, *p_W, yaw=0.0):
    return PlacedObject(thing, RigidTransform(RotationMatrix.MakeZRotation(yaw), p_W))


def refusal(check, *arguments):
    with pytest.raises(SceneError) as error:
        check(*arguments)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_thing_may_be_two_millimetres_in_the_table_and_no_more(brick):
    check_apart([at(brick, 0.5, 0.0, -0.0019)])
    said = refusal(check_apart, [at(brick, 0.3, 0.0, 0.0), at(brick, 0.5, 0.0, -0.05)])
    assert said == (
        "placed[1] (brick) reaches 5.0 cm below the table's top, z = 0; its z would be 0.000 m or more"
    )


def test_two_things_may_be_two_millimetres_in_each_other_and_no_more(brick):
    check_apart([at(brick, 0.5, 0.0, 0.0), at(brick, 0.5585, 0.0, 0.0)])
    check_apart([at(brick, 0.5, 0.0, 0.0), at(brick, 0.5, 0.0, 0.0195)])  # one on the other
    said = refusal(check_apart, [at(brick, 0.3, 0, 0), at(brick, 0.5, 0, 0), at(brick, 0.555, 0, 0)])
    assert said.startswith("placed[1] (brick) and placed[2] (brick) are 5 mm inside each other; expected 2 mm")


def test_what_lies_in_a_hollow_thing_is_not_inside_it(tmp_path, brick):
    walls = [(f"{x} 0 0.03", "0.01 0.1 0.06") for x in (-0.05, 0.05)]
    check_apart([at(model(tmp_path, "tray", *walls), 0.5, 0.0, 0.0), at(brick, 0.5, 0.0, 0.0)])


def test_a_thing_whose_side_is_over_the_tables_edge_is_not_on_it(brick):
    top = Footprint((np.array([(0.0, -0.5), (1.0, -0.5), (1.0, 0.5), (0.0, 0.5)]),), 0.0)
    check_on_top([at(brick, 0.97, 0.0, 0.0)], top)
    check_on_top([at(brick, 0.5, 0.48, 0.0)], top)
    assert refusal(check_on_top, [at(brick, 0.98, 0.0, 0.0)], top) == (
        "placed[0] (brick) at x 0.98, y 0 m is not on the table; its top is x 0.00 to 1.00, y -0.50 to 0.50 m"
    )
    refusal(check_on_top, [at(brick, 0.5, 0.48, 0.0, yaw=np.pi / 2)], top)


def test_a_thing_of_which_the_camera_sees_nothing_is_named_with_what_it_sees(brick):
    camera = Intrinsics(101, 81, 100.0, 100.0, 50.0, 40.0)
    X_WC = RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0.5, 0.0, 1.0])  # sees 1 m by 0.8 m
    check_in_view([at(brick, 1.02, 0.0, 0.0)], X_WC, camera)
    said = refusal(check_in_view, [at(brick, 1.05, 0.0, 0.0)], X_WC, camera)
    assert said.endswith("first view, which shows x 0.00 to 1.00, y -0.40 to 0.40 m of the table")
    level = RigidTransform(RotationMatrix.MakeXRotation(-np.pi / 2), [0.5, -1.0, 0.1])
    check_in_view([at(brick, 0.5, 0.0, 0.0)], level, camera)
    assert "centre_W" in refusal(check_in_view, [at(brick, 0.5, -2.0, 0.0)], level, camera)


@pytest.mark.renders
@pytest.mark.parametrize(
    ("p_WB", "said"),
    [
        ([5.0, 0.0, 0.0], "is not on the table; its top is x -0.25 to 1.15, y -0.80 to 0.80 m"),
        ([0.5, 0.7, 0.0], "is out of the camera's first view, which shows x 0.3"),
        ([0.5, 0.0, -0.05], "reaches 5.0 cm below the table's top"),
    ],
)
def test_a_station_refuses_what_is_placed_where_it_cannot_be_found(tmp_path, brick, p_WB, said):
    thing = PlacedConfig(str(brick.path), [*p_WB, 0.0, 0.0, 0.0])
    config = SimulatedStationConfig(scene=SceneConfig(placed=[thing]))
    with pytest.raises(SceneError) as error:
        SimulatedStation(config)
    assert str(error.value).startswith("placed[0] (brick) ")
    assert said in str(error.value)
