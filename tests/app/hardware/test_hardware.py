import json

import numpy as np
import pytest
from drake import lcmt_panda_status
from pydrake.lcm import DrakeLcm
from pydrake.math import RigidTransform

from riseg_drake.app.bench.stream import is_even
from riseg_drake.app.cli import main
from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.hardware.arm_travel import TravelError, WayBack, straight_motion
from riseg_drake.app.hardware.drivers import HardwareError, wait_for_drivers
from riseg_drake.app.output import RunFolder
from riseg_drake.app.output_folder import SUMMARY
from riseg_drake.app.planned_speed import check_limits, planned_limits, push_parameters
from riseg_drake.app.run.command import state_of
from riseg_drake.app.run.interactions import Progress
from riseg_drake.app.run.truth_reception import TruthReception
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.app.work_state import RunStoppedError
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pushing.time_law import SpeedLimits
from riseg_drake.robot.kinematics import READY, PandaKinematics, observation_posture, tip_pointing_down
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.stations.driver_reasons import reasons_message
from riseg_drake.stations.even_clock import EvenClock
from riseg_drake.stations.ground_truth import LABEL_CHANNEL, POSE_CHANNEL, encode_labels, encode_poses
from riseg_drake.stations.ideal_arm import status_message
from riseg_drake.stations.lcm_images import ImageError, encode_images
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


@pytest.mark.parametrize("robot", ["panda", "fr3"])
def test_with_every_key_left_out_no_default_contradicts_another(robot, tmp_path):
    file = tmp_path / "robot.yaml"
    url = "udpm://239.255.76.67:7667?ttl=0"
    file.write_text(f'station: !HardwareStationConfig {{panda: {{robot: {robot}}}, lcm: {{url: "{url}"}}}}\n')
    scenario = load_scenario(file)
    check_limits(scenario)
    command, planned = scenario.hardware.command.limits, planned_limits(scenario)
    for name in ("velocity", "acceleration", "jerk"):
        assert getattr(planned, name) < getattr(command, name)


def test_planned_motions_are_as_much_slower_as_commands_are_and_as_fast_as_a_scenario_says():
    scenario = load_scenario(None, HARDWARE)
    usual = planned_limits(scenario)
    scenario.hardware.command.limits.velocity /= 2
    scenario.push.path.limits.jerk = 0.05
    slow = planned_limits(scenario)
    assert slow.velocity == pytest.approx(usual.velocity / 2)
    assert slow.acceleration == usual.acceleration
    assert slow.jerk == push_parameters(scenario).path.limits.jerk == 0.05
    assert planned_limits(load_scenario(None)) == SpeedLimits()  # in simulation


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


class Drivers:
    """Arm and camera on a network of this process, on a clock of their own, heard by a Reception."""

    def __init__(self):
        self.config, self.now = load_scenario(None, HARDWARE).hardware, 5000.0
        self.lcm = DrakeLcm("memq://")
        self.reception = Reception(
            self.lcm, self.config.lcm, clock=EvenClock(lambda: self.now, lambda: self.now)
        )

    def speak(self, mode=lcmt_panda_status.kMove, stamp_off=0.0):
        self.now += 0.01
        message = status_message(self.now + stamp_off, READY, mode)
        self.lcm.Publish("PANDA_STATUS", message.encode())
        self.reception.listen()

    def show(self, aligned=True, damaged=False):
        color, depth = np.zeros((480, 848, 3), np.uint8), np.ones((480, 848), np.float32)
        message = encode_images(color, depth if aligned else None, self.now, self.now, 0, raw_depth=depth)
        data = message.encode()
        self.lcm.Publish(self.config.lcm.image_channel, data[: len(data) // 2] if damaged else data)
        self.reception.listen()

    def missing(self, ready=True):
        """What is said when no patience is left; "" if nothing is missing."""
        try:
            wait_for_drivers(self.reception, self.config, patience=0.0, ready=ready)
        except HardwareError as error:
            return str(error)
        return ""


@pytest.mark.parametrize(
    ("mode", "words"),
    [
        (lcmt_panda_status.kUserStopped, r"robot_mode is 5 \(user stopped: release the user stop"),
        (lcmt_panda_status.kReflex, r"robot_mode is 4 \(reflex: unlock"),
        (
            lcmt_panda_status.kIdle,
            r"robot_mode is 1 \(idle: start `riseg drive-arm`, or drake-franka-driver with --control_mode=",
        ),
        (lcmt_panda_status.kGuiding, r"robot_mode is 3 \(guided by hand"),
    ],
)
def test_an_arm_that_takes_no_commands_is_not_waited_for_in_silence(mode, words):
    drivers, said = Drivers(), []
    drivers.speak(mode)
    drivers.show()
    with pytest.raises(HardwareError, match=words):
        wait_for_drivers(drivers.reception, drivers.config, patience=0.0, ready=True, say=said.append)
    assert said[0].startswith("waiting: robot_mode is ")
    assert not drivers.missing(ready=False)  # a dry run moves nothing
    drivers.speak()
    assert not drivers.missing()


def test_errors_by_name_are_told_with_the_mode_until_the_arm_takes_commands_again():
    drivers = Drivers()
    drivers.speak(lcmt_panda_status.kReflex)
    drivers.show()
    message = reasons_message(
        "the robot takes no commands", ["joint_reflex", "power_limit_violation"], drivers.now
    )
    drivers.lcm.Publish(drivers.config.lcm.errors_channel, message.encode())
    drivers.reception.listen()
    words = "its driver says: the robot takes no commands: joint_reflex, power_limit_violation)"
    assert words in drivers.missing()
    drivers.speak(lcmt_panda_status.kReflex)
    assert words in drivers.missing()
    drivers.speak()
    assert not drivers.missing()
    drivers.speak(lcmt_panda_status.kUserStopped)
    assert "its driver says" not in drivers.missing()


def test_a_status_that_has_ended_is_told():
    drivers = Drivers()
    drivers.speak()
    drivers.now += 2
    drivers.show()
    assert "PANDA_STATUS has ended (start `riseg drive-arm` or drake-franka-driver again)" in drivers.missing()


def test_messages_that_are_left_out_are_told_to_whoever_waits_for_others():
    drivers = Drivers()
    drivers.speak(stamp_off=7.0)
    drivers.show()
    assert "ahead of this computer's clock (by 7.000 s; computers of drivers and program" in drivers.missing()


def test_a_damaged_picture_at_the_beginning_is_waited_out_and_a_camera_of_another_kind_is_named():
    drivers = Drivers()
    drivers.speak()
    drivers.show(damaged=True)
    assert "no picture came that can be used" in drivers.missing()
    drivers.show()
    assert not drivers.missing()
    other = Drivers()
    other.speak()

    def show():
        for _ in range(40):
            other.now += 0.1
            other.show(aligned=False)
            other.missing(ready=False)

    with pytest.raises(ImageError, match="--software_depth_registration"):
        show()


def test_a_scenario_of_the_drivers_network_alone_is_enough(tmp_path):
    (tmp_path / "robot.yaml").write_text('station: !HardwareStationConfig {lcm: {url: "memq://"}}\n')
    scenario = load_scenario(tmp_path / "robot.yaml", HARDWARE)
    check_limits(scenario)
    assert scenario.hardware.lcm.url == "memq://"


def test_a_run_that_was_stopped_is_not_done(tmp_path):
    folder = RunFolder(tmp_path / "run", {})
    progress = Progress()
    with pytest.raises(RunStoppedError), state_of(folder, progress, []):
        raise RunStoppedError("the arm was stopped: it was pushed")
    summary = json.loads((tmp_path / "run" / SUMMARY).read_text())
    assert (summary["state"], summary["end"]) == ("stopped", "the arm was stopped: it was pushed")


def test_a_stopped_run_ends_with_a_line_and_exit_code_2(monkeypatch, capsys):
    def stopped(chosen, console):
        raise RunStoppedError("the arm was stopped: it was pushed")

    monkeypatch.setattr("riseg_drake.app.commands.hardware", stopped)
    assert main(["hardware"]) == 2
    assert capsys.readouterr().err == "riseg: the arm was stopped: it was pushed\n"


class Commands:
    """Remembers when a new path began."""

    begun = 0

    def begin_path(self):
        self.begun += 1


@pytest.fixture(scope="module")
def at_desk():
    """Kinematics, and a posture to look from."""
    kinematics, config = PandaKinematics(), load_scenario(None, HARDWARE).hardware
    return kinematics, observation_posture(kinematics, config.centre_W, config.observe_height)


def test_the_way_back_begins_where_the_arm_is_goes_up_first_and_is_free(at_desk):
    kinematics, q_observe = at_desk
    commands = Commands()
    way_back = WayBack(kinematics, q_observe, SpeedLimits(0.28, 0.24, 0.1), commands)
    low = kinematics.solve_ik(tip_pointing_down([0.6, 0.15, 0.02], 0.3), q_observe)
    seconds = way_back.plan(low)
    assert commands.begun == 0
    motion = way_back.take()
    assert motion.end_time() == seconds
    assert commands.begun == 1
    assert way_back.take() is None
    assert commands.begun == 1
    assert motion.value(0)[:, 0] == pytest.approx(low)
    assert motion.value(seconds)[:, 0] == pytest.approx(q_observe)
    tips = np.array([kinematics.X_WE(motion.value(t)[:, 0])[:3, 3] for t in np.linspace(0, seconds, 200)])
    below = (tips[:, 2] < WayBack.ABOVE - 0.01) & (np.arange(200) < tips[:, 2].argmax())
    np.testing.assert_allclose(tips[below][:, :2], np.tile([0.6, 0.15], (below.sum(), 1)), atol=2e-3)
    assert (np.diff(tips[below][:, 2]) > -1e-6).all()
    velocity = motion.MakeDerivative().vector_values(np.linspace(0, seconds, 500))
    assert (np.abs(velocity) <= 0.285 * PANDA_LIMITS.velocity[:, None]).all()


def test_where_there_is_no_free_way_back_somebody_has_to_guide_the_arm(at_desk, monkeypatch):
    kinematics, q_observe = at_desk
    way_back = WayBack(kinematics, q_observe, SpeedLimits(), Commands())
    monkeypatch.setattr(kinematics, "clearance", lambda q: 0.0)  # it touches something everywhere
    with pytest.raises(TravelError, match="guide the arm by hand"):
        way_back.plan(q_observe + 0.2)
    assert way_back.take() is None


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
    poses = encode_poses({1: "duck"}, {1: RigidTransform([0.1, 0.2, 0.3])}, {1: np.eye(3)[2:]}, stamp)
    lcm.Publish(POSE_CHANNEL, poses.encode())
    lcm.Publish(LABEL_CHANNEL, encode_labels(labels, stamp, 0).encode())
    lcm.HandleSubscriptions(0)

    def frame(time):
        color = np.zeros((3, 4, 3), np.uint8)
        return Frame(0, time, None, color, color[..., 0], np.eye(4), color[..., 0] > 0)

    known = truth(frame(stamp / 1e3 + offset))
    np.testing.assert_array_equal(known.labels, labels[:, 2:6])
    np.testing.assert_allclose(known.poses["duck"][:3, 3], [0.1, 0.2, 0.3], atol=1e-6)
    np.testing.assert_array_equal(known.axes["duck"], [[0.0, 0.0, 1.0]])
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


@pytest.mark.parametrize(
    ("error", "code", "state"),
    [(KeyboardInterrupt(), 130, "interrupted"), (HardwareError("nothing came"), 2, "failed")],
)
def test_a_session_that_ends_while_it_waits_for_the_drivers_says_so_in_its_summary(
    error, code, state, tmp_path, monkeypatch, capsys
):
    def wait(*_, **__):
        raise error

    monkeypatch.setattr("riseg_drake.app.hardware.command.wait_for_drivers", wait)
    scenario = tmp_path / "robot.yaml"
    scenario.write_text('station: !HardwareStationConfig {lcm: {url: "memq://"}}\n')
    assert main(["hardware", str(scenario), "--yes", "--output", str(tmp_path / "out")]) == code
    assert json.loads((tmp_path / "out" / SUMMARY).read_text())["state"] == state
    assert capsys.readouterr().err.count("\n") == 1
