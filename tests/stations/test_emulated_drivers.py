import numpy as np
import pytest
from drake import lcmt_image_array, lcmt_panda_command, lcmt_panda_status, lcmt_viewer_draw
from pydrake.lcm import DrakeLcm
from pydrake.manipulation import PandaStatusReceiver
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmSubscriberSystem

from riseg_drake.robot.description import PandaDescription
from riseg_drake.robot.kinematics import PandaKinematics, tip_pointing_down
from riseg_drake.robot.limits import FR3_LIMITS
from riseg_drake.stations.emulated_arm import EmulatedArm
from riseg_drake.stations.emulated_camera import EmulatedCamera, full_picture, seen_beside
from riseg_drake.stations.emulated_drivers import CameraSide, EmulatorConfig, Moment, PandaSide
from riseg_drake.stations.ground_truth import LABEL_CHANNEL, POSE_CHANNEL, decode_labels, decode_poses
from riseg_drake.stations.lcm_images import ALIGNED_DEPTH, ImageError, decode_image, decode_images
from riseg_drake.stations.misbehaviour import CONTROL_CHANNEL
from riseg_drake.stations.panda_driver import ABORTED, ENDED, KILLED
from riseg_drake.stations.panda_robot import MOVE
from riseg_drake.stations.simulated import SimulatedStation, SimulatedStationConfig
from riseg_drake.stations.wrist_camera import CameraConfig

pytestmark = pytest.mark.renders

WALL = 1_700_000_000_000_000  # us, when the emulator starts


def one_toy(**changes):
    config = SimulatedStationConfig(**changes)
    config.scene.count_min = config.scene.count_max = 1
    return config


class Robot:
    """An emulated arm and a client on one LCM in this process, on a clock that the test turns."""

    def __init__(self, config=None, faults=(), **driver):
        self.lcm = DrakeLcm("memq://")
        self.config = EmulatorConfig()
        self.config.driver.control_mode = "position"
        for name, value in driver.items():
            setattr(self.config.driver, name, value)
        arm = EmulatedArm(config or one_toy(), self.config.driver, 0, WALL)
        self.side = PandaSide(self.lcm, self.config, arm, seed=0, faults=faults)
        self.now = WALL
        self.raw = []
        self.lcm.Subscribe("PANDA_STATUS", self.raw.append)
        self.wait(2)
        self.start = arm.driver.robot.q_d

    @property
    def status(self):
        return lcmt_panda_status.decode(self.raw[-1])

    def wait(self, milliseconds, every=1):
        """What was published meanwhile; the emulator's process gets to run `every` so many ms."""
        before = len(self.raw)
        for _ in range(milliseconds // every):
            self.now += 1000 * every
            self.side.advance(self.now)
            self.lcm.HandleSubscriptions(0)
        self.lcm.HandleSubscriptions(0)
        return [lcmt_panda_status.decode(raw) for raw in self.raw[before:]]

    def say(self, word, milliseconds=2):
        self.lcm.Publish(CONTROL_CHANNEL, word.encode())
        return self.wait(milliseconds)

    @property
    def end(self):
        return self.side.arm.driver.end

    def send(self, q, mode=1, milliseconds=5):
        message = lcmt_panda_command()
        message.utime, message.control_mode_expected = self.now, mode
        name = {1: "position", 2: "velocity"}[mode]
        setattr(message, f"num_joint_{name}", len(q))
        setattr(message, f"joint_{name}", list(q))
        self.lcm.Publish("PANDA_COMMAND", message.encode())
        return self.wait(milliseconds)

    def move(self, q_goal, seconds):
        """A smooth motion from where the arm is set to be."""
        q_start = np.array(self.status.joint_position_desired)
        for share in np.linspace(0, 1, int(seconds / 0.005)):
            self.send(q_start + (q_goal - q_start) * share**3 * (10 - 15 * share + 6 * share**2))
        return self


@pytest.fixture(scope="module")
def robot():
    return Robot()


def test_status_is_the_drivers(robot):
    told = robot.wait(20)
    assert [message.utime for message in told] == [robot.now - 1000 * k for k in range(19, -1, -1)]
    assert np.diff([message.robot_utime for message in told]).tolist() == [1000] * 19
    status = told[-1]
    assert (status.num_joints, status.robot_mode, status.control_mode) == (7, MOVE, 0)
    assert status.control_command_success_rate == 1.0


def test_drakes_own_receiver_reads_the_status(robot):
    builder = DiagramBuilder()
    subscriber = LcmSubscriberSystem.Make("PANDA_STATUS", lcmt_panda_status, robot.lcm, use_cpp_serializer=True)
    receiver = builder.AddSystem(PandaStatusReceiver())
    builder.Connect(builder.AddSystem(subscriber).get_output_port(), receiver.get_input_port())
    robot.wait(3)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.01)
    context = receiver.GetMyContextFromRoot(simulator.get_context())
    measured = receiver.GetOutputPort("position_measured").Eval(context)
    np.testing.assert_allclose(measured, robot.status.joint_position)


def test_the_arm_goes_where_a_stream_of_positions_leads(robot):
    goal = np.add(robot.start, [0.2, 0.1, -0.2, 0.1, 0.2, -0.1, 0.3])
    robot.move(goal, 1.0)
    moving = robot.status.joint_velocity_desired
    robot.send(goal, milliseconds=90)
    assert robot.status.robot_mode == MOVE
    assert np.abs(moving).max() < 0.05
    kinematics = PandaKinematics()
    p_WE, p_WGoal = (kinematics.X_WE(np.array(q))[:3, 3] for q in (robot.status.joint_position, goal))
    assert np.linalg.norm(p_WE - p_WGoal) < 1e-3
    robot.move(robot.start, 1.0)


def test_a_process_that_was_kept_from_running_catches_up_in_one_message(robot):
    (status,) = robot.wait(30, every=30)
    assert status.utime == robot.now
    before = status.robot_utime
    (status,) = robot.wait(300, every=300)
    assert status.utime == robot.now
    assert status.robot_utime - before < 100_000  # what was missed for long is left out


def test_a_computer_that_is_too_slow_is_told_every_ten_seconds_with_what_it_reaches():
    robot = Robot()
    robot.wait(60 * 166, every=60)  # 9.96 s; longer than is made up for, each time
    assert robot.side.notes() == []
    robot.wait(60, every=60)
    (told,) = robot.side.notes()
    assert "too slow: 10.0 of the last 10 s were skipped" in told
    assert "status came at 17 Hz" in told
    robot.wait(60 * 167, every=60)
    assert len(robot.side.notes()) == 1


def test_a_computer_that_keeps_up_is_told_nothing():
    robot = Robot()
    robot.wait(40 * 260, every=40)
    assert robot.side.notes() == []


@pytest.mark.parametrize("by", [1.0, -1.0, 0.3, -0.06])
def test_a_clock_that_is_set_silences_nobody(by):
    robot = Robot()
    robot.now += int(1e6 * by)
    told = robot.wait(20)
    assert [message.utime for message in told] == [robot.now - 1000 * k for k in range(19, -1, -1)]


def test_joint_angles_and_speeds_are_as_noisy_as_said_and_by_seed(robot):
    told = robot.wait(300)
    for measured, desired, noise in (
        ("joint_position", "joint_position_desired", 1e-4),
        ("joint_velocity", "joint_velocity_desired", 7e-3),
    ):
        errors = [np.subtract(getattr(m, measured), getattr(m, desired)) for m in told]
        # Of 2100 numbers, within 4 standard deviations of the spread.
        assert np.std(errors) == pytest.approx(noise, rel=0.062)
    again = EmulatedArm(one_toy(), robot.config.driver, 0, WALL)
    again.tick()
    assert again.status().encode() == robot.raw[0]


def test_without_noise_the_status_is_what_the_physics_is():
    robot = Robot(position_noise=0.0, velocity_noise=0.0)
    np.testing.assert_allclose(robot.status.joint_position, robot.start, atol=1e-9)


def test_a_step_ends_the_driver_and_its_status_until_it_is_started_again(robot):
    for _ in range(30):  # it has left out time before, and judges only what it knows
        robot.send(robot.start)
    robot.side.notes()
    told = robot.send(robot.start + 0.02, milliseconds=2000)
    assert {message.robot_mode for message in told} <= {MOVE}
    assert len(told) <= 1
    (note,) = robot.side.notes()
    assert "exit code 0: reflex joint_motion_generator_velocity_discontinuity" in note
    assert "'start'" in note
    assert robot.send(robot.start) == []
    assert robot.say("start", 1000) == []  # it connects
    assert {message.robot_mode for message in robot.wait(10)} == {MOVE}
    assert robot.send(robot.start)[-1].robot_mode == MOVE


def test_the_stop_button_aborts_the_driver_which_comes_back_once_both_are_seen_to(robot):
    assert robot.say("stop", 50) == []
    assert robot.end.code == ABORTED
    assert robot.say("start", 1100) == []
    assert robot.end.code == ABORTED
    robot.say("recover")
    assert robot.wait(1100) == []
    assert robot.say("start", 1100)[-1].robot_mode == MOVE


def test_an_arm_without_a_driver_can_be_guided_and_the_camera_sees_it(robot):
    robot.say("guide 1 0.3")
    assert "controlled" in robot.side.notes()[-1]
    robot.say("reflex")
    before = robot.side.arm.positions()
    assert robot.say("guide 1 0.3", 3000) == []
    turned = robot.side.arm.positions() - before
    assert np.sort(np.abs(turned))[-1] == pytest.approx(0.3, abs=1e-3)
    robot.say("guide " + " ".join(f"{angle:.9f}" for angle in robot.start), 3000)
    np.testing.assert_allclose(robot.side.arm.positions(), before, atol=2e-3)
    robot.say("start", 1100)
    np.testing.assert_allclose(robot.status.joint_position_desired, robot.start, atol=2e-4)
    robot.start = robot.side.arm.driver.robot.q_d


def test_a_killed_driver_stays_dead_unless_a_time_was_said(robot):
    assert robot.say("die", 3000) == []
    assert robot.end.code == KILLED
    robot.say("recover")
    robot.say("start", 1100)
    assert robot.say("die 0.2", 1150) == []
    assert {message.robot_mode for message in robot.wait(200)} == {MOVE}


def test_an_fr3_keeps_its_own_limits():
    robot = Robot(one_toy(panda=PandaDescription(robot="fr3")))
    assert robot.side.arm.driver.robot.limits is FR3_LIMITS
    assert FR3_LIMITS.contains(robot.start)
    q = robot.start.copy()
    q[5] = 0.3  # below the FR3's joint 6, and well within the Panda's; speed towards there ends before
    robot.move(q, 4.0)
    assert robot.side.arm.driver.robot.reflex_reason.endswith("velocity_limits_violation")
    assert robot.side.arm.driver.robot.q_d[5] == pytest.approx(FR3_LIMITS.position_lower[5], abs=0.3)


def test_faults_hold_from_the_start_however_many_there_are():
    robot = Robot(faults=["status drop 1", "images drop 0.5", "status delay 0.03", "stop"])
    assert robot.side.arm.driver.end.code == ABORTED


def test_a_stalled_driver_is_silent_and_goes_on(robot):
    robot.say("status stall 0.1")
    assert robot.wait(80) == []
    assert len(robot.wait(50)) == pytest.approx(30, abs=3)


def test_status_goes_astray_as_asked_for(robot):
    robot.say("status drop 0.5")
    assert len(robot.wait(400)) == pytest.approx(200, abs=50)
    robot.say("status drop 0")
    assert len(robot.wait(100)) == 100


def test_what_is_no_command_and_no_word_is_ignored_and_told(robot):
    robot.side.notes()
    robot.lcm.Publish("PANDA_COMMAND", b"nonsense")
    robot.lcm.Publish(CONTROL_CHANNEL, b"dance")
    assert robot.wait(5)[-1].robot_mode == MOVE
    notes = robot.side.notes()
    assert len(notes) == 2
    assert all("\n" not in note for note in notes)


def test_a_command_of_the_wrong_mode_ends_the_driver():
    robot = Robot()
    robot.send(np.zeros(7), mode=2)
    assert (robot.end.code, "--control_mode=position" in robot.end.reason) == (ENDED, True)


def test_velocities_are_followed_and_end_by_themselves():
    robot = Robot(control_mode="velocity")
    speed = np.array([0.2, 0, 0, 0, 0, 0, 0])
    for k in range(60):
        robot.send(speed * min(1.0, k / 20), mode=2)
    assert robot.status.joint_velocity[0] == pytest.approx(0.2, abs=0.03)
    robot.wait(150)
    np.testing.assert_allclose(robot.status.joint_velocity_desired, 0, atol=1e-4)
    robot.wait(600)
    assert not robot.side.arm.driver.robot.is_moving
    assert robot.status.robot_mode == MOVE


def test_external_torque_is_what_the_arm_does_to_the_table():
    kinematics = PandaKinematics()
    q = kinematics.solve_ik(tip_pointing_down([0.35, 0.2, 0.005], 0.0))
    robot = Robot(one_toy(start_position=list(q)))
    down = np.linalg.pinv(kinematics.tip_jacobian(q)) @ [0, 0, 0, 0, 0, -0.008]
    robot.move(q + down, 0.5)
    torque = np.array(robot.status.joint_torque_external)
    f_E_W = np.linalg.lstsq(kinematics.tip_jacobian(q).T, torque, rcond=None)[0][3:]
    assert f_E_W[2] < -1.0  # downwards, N; Drake counts what the table does to the arm
    assert abs(f_E_W[2]) > 2 * np.abs(f_E_W[:2]).max()


class Eye:
    """An emulated camera and a client."""

    def __init__(self, **config):
        self.lcm = DrakeLcm("memq://")
        self.config = EmulatorConfig(**config)
        self.station = one_toy()
        self.station.camera.noise.enabled = False
        self.positions = EmulatedArm(self.station, self.config.driver, 0, WALL).positions()
        self.side = CameraSide(self.lcm, self.config, EmulatedCamera(self.station, seed=0), seed=0)
        self.heard = {}
        for channel, kind in (
            (self.config.lcm.image_channel, lcmt_image_array),
            (LABEL_CHANNEL, lcmt_image_array),
            (POSE_CHANNEL, lcmt_viewer_draw),
        ):
            messages = self.heard[channel] = []
            self.lcm.Subscribe(channel, lambda raw, m=messages, k=kind: m.append(k.decode(raw)))

    def show(self, wall_us=WALL + 123_456, is_standing=True, now=WALL * 1e-6 + 0.2):
        self.side.show(Moment(wall_us, self.positions, is_standing), now)
        self.side.flush(now)
        self.lcm.HandleSubscriptions(0)
        return self.heard[self.config.lcm.image_channel]


@pytest.fixture(scope="module")
def eye():
    eye = Eye()
    eye.show()
    return eye


def test_pictures_are_the_cameras(eye):
    message = eye.heard[eye.config.lcm.image_channel][0]
    assert [image.header.frame_name for image in message.images] == ["color", "depth", ALIGNED_DEPTH]
    assert {(image.width, image.height) for image in message.images} == {(848, 480)}
    assert {image.header.utime for image in message.images} == {(WALL + 123_456) // 1000}
    assert message.header.utime == pytest.approx(WALL + 200_000, abs=1)


def test_the_middle_of_the_picture_is_what_the_simulated_station_sees(eye):
    station = SimulatedStation(eye.station, seed=0)
    context = station.CreateDefaultContext()
    truth = {
        name: station.GetOutputPort(f"cheat.{name}").Eval(context).data
        for name in ("color_image", "label_image")
    }
    images = decode_images(eye.heard[eye.config.lcm.image_channel][0])
    middle = slice(104, 744)
    off = np.abs(images.color[:, middle].astype(int) - truth["color_image"][..., :3])
    assert np.percentile(off, 99) <= 12  # JPEG
    labels = decode_labels(eye.heard[LABEL_CHANNEL][0])
    np.testing.assert_array_equal(labels.labels[:, middle], truth["label_image"][..., 0])
    assert labels.labels.max() == 1
    assert labels.time == images.time


def test_poses_are_where_the_objects_stand(eye):
    poses = decode_poses(eye.heard[POSE_CHANNEL][0])
    station = SimulatedStation(eye.station, seed=0)
    (thing,) = station.objects
    X_WBcm = thing.X_WB @ RigidTransform(thing.model.centre)
    np.testing.assert_allclose(poses.X_WBcm[1], X_WBcm.GetAsMatrix4(), atol=1e-6)
    np.testing.assert_array_equal(poses.axes[1], thing.model.axes)
    assert poses.names == {1: thing.name}


def test_labels_are_drawn_only_while_the_arm_stands(eye):
    labels, poses = (len(eye.heard[channel]) for channel in (LABEL_CHANNEL, POSE_CHANNEL))
    eye.show(is_standing=False)
    assert len(eye.heard[LABEL_CHANNEL]) == labels
    assert len(eye.heard[POSE_CHANNEL]) == poses + 1


def test_unaligned_depth_is_displaced_by_its_disparity(eye):
    message = eye.heard[eye.config.lcm.image_channel][0]
    aligned, raw = (
        decode_image(next(i for i in message.images if i.header.frame_name == name))
        for name in (ALIGNED_DEPTH, "depth")
    )
    assert (aligned != raw).mean() > 0.005
    edge = np.full((4, 200), 0.5, np.float32)
    edge[:, 100:] = 0.4
    camera = full_picture(CameraConfig())
    displaced = seen_beside(edge, camera)
    assert np.flatnonzero(displaced[0] == np.float32(0.4))[0] == pytest.approx(
        100 + camera.fx * 0.015 / 0.4, abs=1
    )


def test_without_registration_there_is_only_depth_that_is_refused():
    (message,) = Eye(software_depth_registration=False, ir=True).show()
    names = [image.header.frame_name for image in message.images]
    assert names == ["color", "depth", "infrared", "infrared_stereo"]
    with pytest.raises(ImageError, match="--software_depth_registration"):
        decode_images(message)
