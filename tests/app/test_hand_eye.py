import numpy as np
from pydrake.lcm import DrakeLcm

from riseg_drake.app.hand_eye import _Collector, _postures
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.robot.kinematics import READY, PandaKinematics
from riseg_drake.stations.even_clock import EvenClock
from riseg_drake.stations.ideal_arm import status_message
from riseg_drake.stations.lcm_images import encode_images
from riseg_drake.stations.lcm_reception import Reception

START = 1_790_000_000.0


def test_every_picture_is_kept_once_with_the_cameras_pose_of_its_own_time():
    now = START
    config = load_scenario(None, HARDWARE).hardware
    config.camera.latency = 0.04
    kinematics, lcm = PandaKinematics(config.panda), DrakeLcm("memq://")
    reception = Reception(lcm, config.lcm, clock=EvenClock(lambda: now, lambda: now))
    collector = _Collector(reception, config.camera, kinematics)
    for now in np.arange(START, START + 0.5, 0.01):
        lcm.Publish(config.lcm.status_channel, status_message(now, READY + (now - START)).encode())
        reception.listen()
    color, depth = np.full((480, 848, 3), 90, np.uint8), np.full((480, 848), 0.5, np.float32)
    for taken in (START + 0.2, START + 0.3):
        message = encode_images(color, depth, taken, taken + 0.03, 0)
        lcm.Publish(config.lcm.image_channel, message.encode())
        reception.listen()
        for _ in range(2):
            collector.look()
    assert [frame.sequence for frame in collector.frames] == [0, 1]
    for frame, since in zip(collector.frames, (0.16, 0.26), strict=True):
        np.testing.assert_allclose(frame.X_WC, kinematics.X_WC(READY + since), atol=1e-5)
        assert frame.color.shape == (480, 640, 3)
        assert frame.robot.shape == (480, 640)


def test_the_arm_moves_by_four_centimetres_around_where_it_looks_from_and_back():
    config = load_scenario(None, HARDWARE).hardware
    kinematics = PandaKinematics(config.panda)
    tips = np.array([kinematics.X_WE(q)[:3, 3] for q in _postures(kinematics, config)])
    np.testing.assert_allclose(np.linalg.norm(tips[1:-1] - tips[0], axis=1), 0.04, atol=1e-6)
    np.testing.assert_allclose(tips[-1], tips[0], atol=1e-6)
