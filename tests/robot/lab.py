"""An arm with its driver and whoever commands it, on a clock that the test turns: nothing sleeps."""

import numpy as np

from riseg_drake.pushing.time_law import SpeedLimits, minimum_jerk, rest_to_rest
from riseg_drake.robot.command_stream import ArmStatus, CommandParameters, CommandStream
from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.robot.supervisor import MOVE
from riseg_drake.robot.tip_geometry import TipGeometry

PERIOD, TICK = 0.005, 0.001
"""Of commands and of the robot, s."""
EXPIRY = 0.1
"""The driver follows no command that is older, s."""
LOW_PASS = TICK / (TICK + 1 / (2 * np.pi * 30))
"""What a tick lets through of the difference to a command: the driver's filter of 30 Hz."""
FASTEST = 2.175
"""An arm that is told to be elsewhere goes there this fast, rad/s."""


class Lab:
    """The driver dies and is started anew at the test's word; while it is dead the arm may be moved by hand."""

    def __init__(self, mode, robot=PANDA_LIMITS, noise=0.0, seed=0, q=READY):
        self.rng, self.noise, self.robot = np.random.default_rng(seed), noise, robot
        tip = TipGeometry(lambda q: np.array([0.5, 0.0, 0.2]), lambda q: np.eye(6, 7))
        self.mode, self.stream = mode, CommandStream(CommandParameters(mode=mode), tip, robot)
        self.now = 1000.0
        self.image_time = self.now
        self.shows = True
        self.q, self.robot_mode, self.is_alive = np.array(q), MOVE, True
        self.v, self.torque = np.zeros(7), np.zeros(7)
        self.status, self.last_stamp = None, None  # the newest that was heard
        self.late_until, self.late_gap = -np.inf, None
        self.command = (-np.inf, None)
        self.commands, self.speeds, self.measured = [], [], []
        self.path, self.path_start = None, 0.0
        self.run(2 * PERIOD)

    def step(self):
        """One round of the process that sends commands, and the robot's milliseconds until the next."""
        if self.path is not None:
            since = min(self.now - self.path_start, self.path.end_time())
            self.stream.add_target(self.now, self.path.value(max(since, 0.0))[:, 0])
        command = self.stream.step(self.now, self.status, self.image_time)
        self.commands.append(None if command is None else command.copy())
        self.measured.append(None if self.status is None else self.status.position)
        if command is not None and self.is_alive:
            self.command = (self.now, command.copy())
        gap, before = 0.0, self.q
        for _ in range(round(PERIOD / TICK)):
            self.now += TICK
            if self.is_alive:
                self._follow()
                gap = max(gap, 0.0 if self.last_stamp is None else self.now - self.last_stamp)
                self.last_stamp = self.now
        self.speeds.append(np.abs(self.q - before) / PERIOD)
        if self.is_alive and self.now >= self.late_until:
            measured = self.q + self.noise * self.rng.normal(size=7)
            gap = gap if self.late_gap is None else self.late_gap
            self.status = ArmStatus(self.now, measured, np.zeros(7), self.torque, self.robot_mode, gap=gap)
            self.late_gap = None
        if self.shows:
            self.image_time = self.now - 0.05

    def _follow(self):
        stamp, values = self.command
        if self.robot_mode != MOVE or values is None:
            return
        if self.mode == "velocity":
            self.v = self.v + LOW_PASS * (values * (self.now - stamp <= EXPIRY) - self.v)
            self.q = self.q + TICK * self.v
        else:  # held for ever
            self.q = self.q + np.clip(LOW_PASS * (values - self.q), -FASTEST * TICK, FASTEST * TICK)

    def run(self, seconds):
        for _ in range(round(seconds / PERIOD)):
            self.step()
        return self

    def go(self, q_to, q_from=None):
        """A planned motion, of which the target for each moment comes at that moment."""
        start = self.stream.position if q_from is None else q_from
        way = np.linspace(start, q_to, 12)
        self.path = rest_to_rest(way, minimum_jerk, SpeedLimits(0.28, 0.24, 0.1), self.robot)
        self.path_start = self.now
        return self.path.end_time()

    def die(self):
        self.is_alive = False

    def start_anew(self):
        self.is_alive, self.robot_mode, self.command = True, MOVE, (-np.inf, None)
        self.v = np.zeros(7)

    def forget(self):
        """What was sent, measured and done so far."""
        for record in (self.commands, self.measured, self.speeds):
            record.clear()

    def sent(self):
        return [command for command in self.commands if command is not None]

    def push_against(self, newton_metres):
        self.torque = np.full(7, newton_metres)

    def guide(self, turn):
        assert not self.is_alive
        self.q = self.q + turn

    def delay_images(self):
        self.shows = False
        self.image_time = self.now - 10.0

    def show_images(self):
        self.shows = True

    def delay_status(self, seconds, gap):
        """Nothing is heard for some time, s; then all that was said, with such a gap between two stamps, s."""
        self.late_until, self.late_gap = self.now + seconds, gap
