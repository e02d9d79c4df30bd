"""`riseg drive-arm` as a process, a client on LCM, and franka-sim in its own: every wait is for a message."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from drake import lcmt_panda_command, lcmt_panda_status
from pydrake.lcm import DrakeLcm

from riseg_drake.robot.kinematics import READY
from riseg_drake.stations.command_session import command_message, word_message
from riseg_drake.stations.driver_reasons import told_reasons
from riseg_drake.stations.lcm_channels import LcmConfig
from tests.stations.franka_rig import FrankaServer, franka_python

MOVE, REFLEX = lcmt_panda_status.kMove, lcmt_panda_status.kReflex
STOPPED = "drive-arm: the robot takes no commands"
RECOVERING = "drive-arm: the operator says that the arm may move: recovering the robot"
DEADLINE = 120.0  # s, for anything that is waited for


class Client:
    """What `riseg hardware` is to the driver: hears it, and holds the arm at a posture.

    A posture that is held never ends in motion, however late this process is woken: the driver moves the arm
    there by itself.
    """

    def __init__(self, config, driver):
        self.config, self.driver, self.network = config, driver, DrakeLcm(config.url)
        self.statuses, self.status, self.says, self.held = 0, None, "", None
        self.words, self.word_said = 0, 0
        self.network.Subscribe(config.status_channel, self.hear)
        self.network.Subscribe(config.errors_channel, self.hear_reasons)

    def hear(self, data):
        self.status = lcmt_panda_status.decode(data)
        self.statuses += 1

    def hear_reasons(self, data):
        self.says = told_reasons(data)

    def until(self, condition):
        deadline = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < deadline, f"nothing came in time; {self.statuses} statuses, {self.says}"
            assert self.driver.poll() is None, self.driver.communicate()
            if self.held is not None:
                message: lcmt_panda_command = command_message(self.held, "position", time.time())
                self.network.Publish(self.config.command_channel, message.encode())
            self.network.HandleSubscriptions(5)

    def until_more(self, statuses):
        end = self.statuses + statuses
        self.until(lambda: self.statuses >= end)

    def until_at(self, q):
        """Where this machine is late the robot stops by itself: the word is said again, until it is there."""

        def there():
            if self.status.robot_mode == REFLEX and self.statuses > self.word_said + 500:
                self.say_word()
            return self.is_at(q)

        self.held = q
        self.until(there)

    def is_at(self, q):
        told = np.array(self.status.joint_position_desired)
        return self.status.robot_mode == MOVE and np.abs(told - q).max() < 1e-4

    def say_word(self):
        self.words, self.word_said = self.words + 1, self.statuses
        self.network.Publish(self.config.recovery_channel, word_message(time.time()).encode())


@pytest.mark.renders
def test_a_live_driver_connects_holds_tells_a_reflex_by_name_and_recovers_at_the_word_alone(tmp_path):
    franka_python()
    url = f"udpm://239.255.76.67:{21000 + os.getpid() % 20000}?ttl=0"
    scenario = tmp_path / "arm.yaml"
    scenario.write_text(
        f"station: !HardwareStationConfig {{lcm: {{url: '{url}'}}, panda: {{robot: fr3}}}}\n", encoding="utf-8"
    )
    with FrankaServer("127.0.0.58", READY, "paced") as server:
        driver = subprocess.Popen(
            [
                *(sys.executable, "-m", "riseg_drake", "drive-arm", str(scenario)),
                *("--ip", server.address, "--mode", "position"),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "COLUMNS": "200"},
        )
        try:
            client = Client(LcmConfig(url=url), driver)
            client.until(lambda: client.status is not None and client.status.robot_mode == MOVE)
            start = np.array(client.status.joint_position_desired)
            np.testing.assert_allclose(start, READY, atol=1e-3)
            beside = start + 0.02 * np.array([1, -1, 1, -1, 1, -1, 1])
            client.until_at(beside)
            assert client.says == "" or client.words

            named = "the robot takes no commands: joint_velocity_violation"
            for _ in range(5):  # a robot that this machine was late for has a reflex of another name already
                client.until_at(beside)
                server.say("reflex")
                client.until(lambda: client.status.robot_mode == REFLEX and client.says)
                if client.says.startswith(named):
                    break
            assert client.says.startswith(named)
            client.held = start
            client.until_more(300)  # commands alone lead nowhere
            assert client.status.robot_mode == REFLEX
            np.testing.assert_allclose(client.status.joint_position, beside, atol=2e-3)

            client.say_word()
            client.until_at(start)
            driver.send_signal(signal.SIGINT)
            out, err = driver.communicate(timeout=DEADLINE)
        finally:
            driver.kill()
            driver.communicate()
    assert driver.returncode == 0, err
    lines = out.splitlines()
    assert lines[0].startswith(f"drive-arm: connecting to {server.address}; ")
    assert lines[1].startswith(f"drive-arm: fr3 at {server.address}, commands of position")
    stopped = [line.startswith(f"{STOPPED}: joint_velocity_violation") for line in lines]
    assert RECOVERING in lines[stopped.index(True) + 1 :]
    assert 1 <= lines.count(RECOVERING) <= client.words
    assert lines[-1].startswith("drive-arm: work of a cycle ")
    print(lines[-1], f"the word was said {client.words} times", sep="; ")
