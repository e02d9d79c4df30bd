"""The emulated driver and the command path in one process, on a clock that the test turns: no LCM, no waiting.

What is real here: CommandSession with its doors and its stream, as the process of commands calls it, and
PandaDriver with its robot, as the emulator does. What is not: the physics (the robot is where it sets itself)
and the network (it keeps the first message of a channel until it is listened to, as LCM does, and may lose
commands).
"""

import numpy as np
from drake import lcmt_image_array

from riseg_drake.robot.command_stream import CommandParameters, CommandStream
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.robot.tip_geometry import TipGeometry
from riseg_drake.stations.command_session import CommandSession, command_message
from riseg_drake.stations.ideal_arm import status_message
from riseg_drake.stations.panda_driver import PandaDriver, PandaDriverConfig
from riseg_drake.stations.panda_robot import GUIDING

WALL, STEADY = 1_700_000_000.0, 5000.0  # s, at the beginning
TICK = 1e-3  # s


def ideal_tip():
    """A tip that is always well within the workspace."""
    return TipGeometry(lambda q: np.array([0.5, 0.0, 0.2]), lambda q: np.eye(6, 7))


class DriverAndStream:
    """A client with its targets, the driver, and the robot.

    `parameters` are the client's (its mode is the driver's, too); `driver` changes fields of PandaDriverConfig.
    `stalls` keeps the client's process from running for so many seconds, once: "asleep" between two rounds, or
    "at work" between a command and its sending; `wakes_late` draws the seconds by which a sleep is too long.
    `lost` is the share of commands that go astray.
    """

    def __init__(
        self,
        mode="velocity",
        limits=PANDA_LIMITS,
        q=READY,
        parameters=None,
        tip=None,
        seed=0,
        lost=0.0,
        wakes_late=lambda rng: 0.0,
        **driver,
    ):
        self.rng = np.random.default_rng(seed)
        self.lost, self.wakes_late = lost, wakes_late
        self.parameters = parameters or CommandParameters()
        self.parameters.mode = mode
        self.driver = PandaDriver(PandaDriverConfig(control_mode=mode, **driver), q, limits)
        self.stream = CommandStream(self.parameters, tip or ideal_tip(), limits)
        self.session = CommandSession(self.stream, STEADY, "PANDA_STATUS", "IMAGES")
        self.now = 0.0
        self.stalls = {"asleep": 0.0, "at work": 0.0}
        self.shows_pictures = True
        self.torque_external = np.zeros(7)
        self.sent = []
        """(time, s, command) of all that was sent, lost ones included."""
        self.trace = []
        """(time, s, robot_mode, q_d, v_d) of every tick."""
        self._ticks = 0
        self._unheard = None

    @property
    def robot(self):
        return self.driver.robot

    @property
    def wall(self):
        """Wall time, s."""
        return WALL + self.now

    def tick(self):
        """The next millisecond of driver and robot, and what the driver publishes then."""
        self._ticks += 1
        self.now = TICK * self._ticks
        self.driver.tick(round(1e6 * self.wall))
        robot = self.robot
        self.trace.append((self.now, robot.mode, robot.q_d, robot.v_d))
        if self.driver.is_connected and self._unheard is None:
            self._unheard = self._status()

    def _status(self):
        robot, config = self.robot, self.driver.config
        position_error, velocity_error = self.rng.standard_normal((2, 7))
        message = status_message(self.wall, robot.q_d + config.position_noise * position_error, robot.mode)
        message.joint_velocity = (robot.v_d + config.velocity_noise * velocity_error).tolist()
        message.joint_torque_external = self.torque_external.tolist()
        message.robot_utime = 1000 * self._ticks
        return message.encode()

    def let(self, seconds):
        """Time passes, without the client."""
        end = self.now + seconds
        while TICK * (self._ticks + 1) <= end + 1e-9:
            self.tick()
        self.now = end

    def cycle(self):
        """One round of the client's process."""
        if self._unheard is not None:
            self.session.hear_status(self._unheard)
            self._unheard = None
        if self.shows_pictures:
            picture = lcmt_image_array()
            picture.header.utime = round(1e6 * self.wall)
            self.session.hear_picture(picture.encode())
        command = self.session.next(STEADY + self.now, self.wall)
        self.let(self.stalls["at work"])
        if command is not None and command.is_in_time(STEADY + self.now):
            self.session.was_sent(command)
            self.sent.append((self.now, command))
            if self.rng.random() >= self.lost:
                self.driver.receive(command_message(command.values, self.parameters.mode, command.stamp))
        late = self.wakes_late(self.rng)
        self.let(self.session.wait(STEADY + self.now) + self.stalls["asleep"] + late)
        self.stalls = dict.fromkeys(self.stalls, 0.0)

    def run(self, seconds):
        """Both go on."""
        end = self.now + seconds
        while self.now < end - 1e-9:
            self.cycle()
        assert not self.session.failed
        return self

    def plan(self, path):
        """Send the targets of a trajectory (`value(t)` [7, 1], `end_time()`), every 10 ms, from now on.

        Targets go on for a second at its end, as the product's do.
        """
        for t in np.arange(0, path.end_time() + 1, 0.01):
            self.session.obey("target", self.wall + t, path.value(min(t, path.end_time()))[:, 0])

    def restart(self):
        """Somebody sees to it that the robot is not stopped, and starts the driver; wait until it speaks."""
        self.robot.recover()
        self.driver.start(round(1e6 * self.wall))
        while not self.driver.is_connected:
            assert self.driver.end is None, self.driver.end
            self.cycle()
        return self

    def guide(self, joint, angle):
        """Somebody turns a joint, 0 to 6, by an angle, rad, and lets go."""
        goal = self.robot.q_d.copy()
        goal[joint] += angle
        self.robot.guide(goal)
        while self.robot.mode == GUIDING:
            self.cycle()
        return self

    def fastest(self, since):
        """Largest speed of a joint since a time, s; rad/s."""
        return max(np.abs(v_d).max() for time, _, _, v_d in self.trace if time >= since)

    def sent_since(self, since):
        """Commands since a time, s."""
        return [command for time, command in self.sent if time >= since]
