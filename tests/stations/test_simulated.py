import cv2
import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from riseg_drake.geometry.camera import back_project
from riseg_drake.geometry.se3 import exp_se3
from riseg_drake.robot.kinematics import PandaKinematics, tip_pointing_down
from riseg_drake.stations.contract import check_contract
from riseg_drake.stations.object_models import measure
from riseg_drake.stations.placed_object import PlacedObject
from riseg_drake.stations.simulated import SimulatedStation, SimulatedStationConfig, start_position

pytestmark = pytest.mark.renders

BOX_SDF = """<sdf version="1.9"><model name="box"><link name="box">
  <inertial><mass>0.1</mass><inertia><ixx>6e-5</ixx><iyy>6e-5</iyy><izz>6e-5</izz></inertia></inertial>
  <visual name="v"><geometry><box><size>0.06 0.06 0.04</size></box></geometry>
    <material><diffuse>{color} 1</diffuse></material></visual>
  <collision name="c"><geometry><box><size>0.06 0.06 0.04</size></box></geometry></collision>
</link></model></sdf>"""
TURN = np.array([0.15, 0, 0, 0, 0, 0, 0])
CENTRES = ((0.46, -0.05), (0.54, 0.06))


@pytest.fixture(scope="module")
def boxes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    placed = []
    for number, (x, y) in enumerate(CENTRES):
        path = folder / f"box{number}.sdf"
        path.write_text(BOX_SDF.format(color=["0.8 0.2 0.1", "0.1 0.3 0.8"][number]))
        placed.append(PlacedObject(measure(path.stem, path), RigidTransform([x, y, 0.02])))
    return placed


class Run:
    """A station under a simulator, with the command at its start."""

    def __init__(self, boxes, seed=0, config=None):
        self.config = config or SimulatedStationConfig()
        self.station = SimulatedStation(self.config, seed, objects=boxes)
        self.simulator = Simulator(self.station)
        self.context = self.simulator.get_mutable_context()
        self.start = np.array(start_position(self.config))
        self.command(self.start)

    def command(self, q):
        self.station.GetInputPort("panda.position").FixValue(self.context, q)

    def __getitem__(self, port):
        value = self.station.GetOutputPort(port).Eval(self.context)
        return value.data.copy() if hasattr(value, "data") and hasattr(value, "width") else value

    def advance(self, time):
        self.simulator.AdvanceTo(time)
        return self


@pytest.fixture(scope="module")
def at_rest(boxes):
    """A station after 0.3 s of standing still."""
    return Run(boxes).advance(0.3)


def test_station_keeps_the_contract(at_rest):
    check_contract(at_rest.station)


def test_arm_starts_looking_straight_down_at_the_work_area_and_stays_there(at_rest):
    X_WC = PandaKinematics().X_WC(at_rest["panda.position_measured"])
    np.testing.assert_allclose(X_WC[:3, 3], [0.5, 0.0, 0.5], atol=1e-4)
    np.testing.assert_allclose(X_WC[:3, 2], [0, 0, -1], atol=1e-4)
    assert np.abs(at_rest["panda.velocity_measured"]).max() < 1e-3


def test_label_image_shows_each_object_where_it_stands(at_rest):
    labels = at_rest["cheat.label_image"][..., 0]
    assert set(np.unique(labels)) == {0, 1, 2}
    k = at_rest.config.camera.intrinsics
    X_CW = np.linalg.inv(PandaKinematics().X_WC(at_rest.start))
    for object_id, (x, y) in enumerate(CENTRES, start=1):
        p_CB = X_CW @ [x, y, 0.04, 1.0]
        u, v = k.fx * p_CB[0] / p_CB[2] + k.cx, k.fy * p_CB[1] / p_CB[2] + k.cy
        rows, columns = np.nonzero(labels == object_id)
        assert (columns.mean(), rows.mean()) == pytest.approx((u, v), abs=6)


def test_label_image_agrees_with_depth(at_rest):
    labels, depth = at_rest["cheat.label_image"][..., 0], at_rest["wrist.depth_image"][..., 0]
    p_CQ = back_project(depth, at_rest.config.camera.intrinsics)
    X_WC = PandaKinematics().X_WC(at_rest.start)
    height = (p_CQ @ X_WC[:3, :3].T + X_WC[:3, 3])[..., 2]
    inside = cv2.erode((labels > 0).astype(np.uint8), np.ones((7, 7))) > 0
    assert np.median(height[inside & (depth > 0)]) == pytest.approx(0.04, abs=0.001)
    table = cv2.dilate((labels > 0).astype(np.uint8), np.ones((9, 9))) == 0
    table &= np.arange(480)[:, None] < 400  # below that is the pusher
    assert np.abs(height[table & (depth > 0)]).max() < 0.006


def test_depth_is_zero_where_it_is_too_near_to_measure(at_rest):
    depth = at_rest["wrist.depth_image"][..., 0]
    measured = depth[depth > 0]
    assert measured.min() >= 0.3
    assert (depth[470, 280:320] == 0).all()  # the pusher's upper part


def test_white_table_leaves_room_below_white(at_rest):
    table = at_rest["wrist.color_image"][:100, :100, :3]
    assert 150 < table.mean() < 235


def test_the_same_seed_gives_the_same_bytes_and_another_seed_other_noise(boxes):
    pictures = [Run(boxes, seed).advance(0.1)["wrist.color_image"].tobytes() for seed in (4, 4, 5)]
    assert pictures[0] == pictures[1]
    assert pictures[0] != pictures[2]


def test_pictures_are_held_between_camera_ticks_and_taken_at_the_camera_rate(boxes):
    run = Run(boxes).advance(0.0)
    times, pictures = set(), set()
    for time in np.arange(0.0, 0.215, 0.01):
        run.advance(time)
        times.add(round(float(run["wrist.image_time"][0]), 4))
        pictures.add(run["wrist.depth_image"].tobytes() + run["wrist.color_image"].tobytes())
    assert len(times) == len(pictures) == 4
    np.testing.assert_allclose(np.diff(sorted(times)), 1 / 15, atol=1e-3)


def test_colour_and_depth_show_the_instant_of_image_time_while_the_arm_moves(boxes):
    config = SimulatedStationConfig()
    config.camera.noise.enabled = False
    run = Run(boxes, config=config).advance(0.01)
    run.command(run.start + TURN)
    run.advance(1.5 / 15)
    held = {name: run[f"wrist.{name}"] for name in ("color_image", "depth_image")}
    # What an ideal camera shows with the joint angles read right after image_time.
    again = Run(boxes, config=config).advance(0.01)
    again.command(run.start + TURN)
    again.advance(float(run["wrist.image_time"][0]) + 0.001)
    np.testing.assert_array_equal(held["color_image"], again["cheat.color_image"])
    np.testing.assert_array_equal(held["depth_image"], again["wrist.depth_image"])
    moved = np.abs(run["cheat.color_image"].astype(int) - held["color_image"]).max()
    assert moved > 50  # the arm did move on meanwhile


def test_a_commanded_motion_is_followed_within_a_millimetre_at_the_tip(boxes):
    run = Run(boxes[:1])
    kinematics = PandaKinematics()
    path = [tip_pointing_down([0.38 + 0.04 * s, -0.04 * s, 0.15], 0.3 * s) for s in np.linspace(0, 1, 101)]
    targets = kinematics.trace_ik(path, run.start)
    worst = 0.0
    for number, q in enumerate(targets):
        run.command(q)
        run.advance(0.02 * (number + 1))
        tip = kinematics.X_WE(run["panda.position_measured"])[:3, 3]
        worst = max(worst, float(np.linalg.norm(tip - path[number][:3, 3])))
    assert worst < 1e-3


def test_table_and_light_can_be_changed(boxes, tmp_path):
    texture = tmp_path / "stripes.png"
    stripes = np.zeros((64, 64, 3), np.uint8)
    stripes[:, ::2] = 255
    cv2.imwrite(str(texture), stripes)
    config = SimulatedStationConfig()
    config.camera.noise.enabled = False
    config.table.texture = str(texture)
    for light in config.renderer.lights:
        light.intensity *= 0.5
    picture = Run(boxes, config=config).advance(0.0)["wrist.color_image"][:100, :, :3]
    assert picture.min() < 10
    assert 80 < picture.max() < 120


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: setattr(c, "start_position", [0.0] * 6), "6 angles; expected 7"),
        (lambda c: setattr(c, "observe_height", 2.0), "observe_height: no posture"),
        (lambda c: setattr(c.table, "texture", "nowhere.png"), "no file nowhere.png"),
    ],
)
def test_settings_that_cannot_be_are_named(boxes, change, message):
    config = SimulatedStationConfig()
    change(config)
    with pytest.raises(ValueError, match=message):
        SimulatedStation(config, objects=boxes)


def test_a_camera_that_is_mounted_wrongly_looks_from_where_it_really_is(boxes):
    config = SimulatedStationConfig()
    config.camera.mount_turn, config.camera.mount_shift = [0.01, -0.02, 0.03], [0.004, 0.0, -0.002]
    poses = []
    for settings in (SimulatedStationConfig(), config):
        run = Run(boxes, config=settings)
        sensor = run.station.GetSubsystemByName("ideal_camera")
        context = sensor.GetMyContextFromRoot(run.context)
        poses.append(sensor.body_pose_in_world_output_port().Eval(context).GetAsMatrix4())
    V = np.concatenate([config.camera.mount_turn, config.camera.mount_shift])
    np.testing.assert_allclose(np.linalg.inv(poses[0]) @ poses[1], exp_se3(V), atol=1e-9)
    # What kinematics say of the camera is what they would say of a right one.
    np.testing.assert_allclose(
        poses[0], PandaKinematics(config.panda).X_WC(np.array(start_position(config))), atol=1e-9
    )
