import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.scenario_file import ScenarioError, parse_scenario
from riseg_drake.stations.emulated_camera import FULL_WIDTH, EmulatedCamera
from riseg_drake.stations.simulated import SimulatedStation

STATIONS = ("", " !HardwareStationConfig")


def camera_of(lines, station=""):
    return parse_scenario(f"station:{station}\n  camera:\n    {lines}\n", Scenario, "a.yaml").station.camera


@pytest.mark.parametrize("station", STATIONS)
def test_a_scenario_fixes_the_camera_to_the_world_where_it_says(station):
    # Half a turn about x, then a quarter about z: it looks straight down, the image's right is W's y.
    camera = camera_of(f"mount: world\n    X_WC: [1.0, 0.2, 0.6, {np.pi}, 0, {np.pi / 2}]", station)
    expected = [[0, 1, 0, 1.0], [1, 0, 0, 0.2], [0, 0, -1, 0.6], [0, 0, 0, 1]]
    np.testing.assert_allclose(camera.fixed_pose, expected, atol=1e-12)


@pytest.mark.parametrize("station", STATIONS)
def test_a_camera_is_on_the_wrist_unless_something_else_is_said(station):
    assert camera_of("rate: 10.0", station).fixed_pose is None


@pytest.mark.parametrize("station", STATIONS)
@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("mount: ceiling", "mount must be one of wrist, world, not 'ceiling'"),
        ("mount: world", r"X_WC is missing; mount: world wants x, y, z \(m\)"),
        ("X_WC: [1, 0, 1, 3, 0, 0]", "X_WC is given, but the camera is on the wrist"),
        ("mount: world\n    X_WC: [1, 0, 1]", "X_WC has 3 numbers; expected 0 or 6"),
        (
            "mount: world\n    X_WC: [1000, 0, 600, 3, 0, 0]",
            "x, y, z are metres from the arm's base, at most 5",
        ),
        ("mount: world\n    X_WC: [1, 0, 1, 180, 0, 0]", "roll, pitch, yaw are radians"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(lines, said, station):
    with pytest.raises(ScenarioError, match=said) as refused:
        camera_of(lines, station)
    assert "\n" not in str(refused.value)


@pytest.mark.renders
def test_simulation_and_emulator_see_from_where_the_camera_is_fixed_however_the_arm_stands():
    config = Scenario().simulated
    # Straight above (0.5, 0.3), where no thing lies, turned so that the image's right is W's y.
    config.camera.mount, config.camera.X_WC = "world", [0.5, 0.3, 0.6, np.pi, 0.0, np.pi / 2]
    config.camera.noise.disparity_std = 0.0
    v, u = round(config.camera.cy), round(config.camera.cx)
    station = SimulatedStation(config, seed=3)
    context = station.CreateDefaultContext()
    Simulator(station, context).Initialize()
    depth = station.GetOutputPort("wrist.depth_image").Eval(context).data[..., 0]
    assert depth[v, u] == pytest.approx(0.6, abs=2e-3)
    emulated = EmulatedCamera(config, seed=3)
    shift = (FULL_WIDTH - config.camera.width) // 2
    for q in (np.zeros(7), np.array([0.5, -0.3, 0, -2, 0, 1.7, 0])):
        positions = emulated._plant.GetPositions(emulated._plant_context)
        positions[:7] = q
        emulated.look(positions)
        assert emulated.picture(0).depth[v, u + shift] == pytest.approx(0.6, abs=2e-3)
