import numpy as np
import pytest
from pydrake.lcm import DrakeLcm
from pydrake.math import RigidTransform

from riseg_drake.app.arm_travel import TravelError, straight_motion
from riseg_drake.app.cli import main
from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.hardware import HardwareError, check_limits, wait_for_drivers
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.app.stream_bench import is_even
from riseg_drake.app.truth_reception import TruthReception
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pushing.time_law import SpeedLimits
from riseg_drake.robot.kinematics import READY, PandaKinematics
from riseg_drake.stations.ground_truth import LABEL_CHANNEL, POSE_CHANNEL, encode_labels, encode_poses
from riseg_drake.stations.lcm_reception import Reception


def port_names(diagram):
    return {diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())}


def test_the_built_in_scenario_of_a_robot_can_stop_in_time_and_is_wired_by_the_same_function():
    scenario = load_scenario(None, HARDWARE)
    check_limits(scenario)
    names = port_names(make_diagram(scenario, seed=0).diagram)
    assert {"wrist.color_image", "panda.position_measured", "mask", "decision", "phase"} <= names
    assert not [name for name in names if name.startswith("cheat.")]


def test_paths_faster_than_commands_may_be_are_refused():
    scenario = load_scenario(None, HARDWARE)
    scenario.push.path.limits.velocity = 0.9
    with pytest.raises(ScenarioError, match=r"push\.path\.limits\.velocity is 0\.9"):
        check_limits(scenario)


def test_commands_too_fast_to_stop_are_refused():
    scenario = load_scenario(None, HARDWARE)
    scenario.hardware.command.limits.velocity = 1.0
    with pytest.raises(ScenarioError, match="lower velocity"):
        check_limits(scenario)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["hardware", "{simulation}"], "wants `station: !HardwareStationConfig`"),
        (["run", "{hardware}"], "describes a real robot"),
        (["emulate", "{hardware}"], "describes a real robot"),
    ],
)
def test_a_scenario_of_the_other_kind_is_refused_in_one_line(arguments, words, tmp_path, capsys):
    (tmp_path / "simulation.yaml").write_text("longest: 10.0\n")
    (tmp_path / "hardware.yaml").write_text("station: !HardwareStationConfig {}\n")
    files = {name: tmp_path / f"{name}.yaml" for name in ("simulation", "hardware")}
    assert main([argument.format(**files) for argument in arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_drivers_that_are_not_there_are_named():
    config = load_scenario(None, HARDWARE).hardware
    reception = Reception(DrakeLcm("memq://"), config.lcm)
    with pytest.raises(HardwareError, match=r"PANDA_STATUS.*nor on DRAKE_RGBD_CAMERA_IMAGES_emulated"):
        wait_for_drivers(reception, config, patience=0.0)


def test_the_arm_does_not_travel_through_the_table():
    kinematics = PandaKinematics()
    low = READY + np.array([0, 1.0, 0, 0.6, 0, 0, 0])
    assert kinematics.clearance(low) < 0
    with pytest.raises(TravelError, match="too near to the table"):
        straight_motion(kinematics, READY, low, SpeedLimits())
    assert straight_motion(kinematics, READY, READY + 0.1, SpeedLimits()).end_time() > 0


@pytest.mark.parametrize("offset", [0.0, 86400.1234567])
def test_the_truth_behind_a_picture_is_found_by_its_stamp_in_a_replayed_log_too(offset):
    lcm = DrakeLcm("memq://")
    truth = TruthReception(lcm, first_column=2, offset=lambda: offset)
    stamp = 1_790_000_000_123
    labels = np.arange(24, dtype=np.uint16).reshape(3, 8)
    poses = encode_poses({1: "duck"}, {1: RigidTransform([0.1, 0.2, 0.3])}, stamp)
    lcm.Publish(POSE_CHANNEL, poses.encode())
    lcm.Publish(LABEL_CHANNEL, encode_labels(labels, stamp, 0).encode())
    lcm.HandleSubscriptions(0)

    def frame(time):
        color = np.zeros((3, 4, 3), np.uint8)
        return Frame(0, time, None, color, color[..., 0], np.eye(4), color[..., 0] > 0)

    known = truth(frame(stamp / 1e3 + offset))
    np.testing.assert_array_equal(known.labels, labels[:, 2:6])
    np.testing.assert_allclose(known.poses["duck"][:3, 3], [0.1, 0.2, 0.3], atol=1e-6)
    assert truth(frame(stamp / 1e3 + offset + 0.1)) is None


@pytest.mark.parametrize(
    ("gaps", "verdict"),
    [
        (np.full(10000, 0.005), True),
        (np.full(10000, 0.0056), False),
        (np.r_[np.full(9980, 0.005), np.full(20, 0.025)], False),
        (np.r_[np.full(9999, 0.005), 0.06], False),
        (np.r_[np.full(9999, 0.005), 0.045], True),
    ],
)
def test_gaps_are_judged_as_a_driver_would(gaps, verdict):
    assert is_even(gaps, 0.005) is verdict
