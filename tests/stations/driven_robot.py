"""A robot that does what it is told, and judges that by differences of the commands, as the real one does."""

import numpy as np
from drake import lcmt_panda_command

from riseg_drake.robot.kinematics import READY
from riseg_drake.robot.limits import FR3_LIMITS
from riseg_drake.robot.supervisor import MOVE
from riseg_drake.stations.arm_drive import ArmDrive, RobotReading
from riseg_drake.stations.rate_limiter import TICK

WALL, ROBOT = 1_700_000_000.0, 4000.0
NAMES = {1: "position", 2: "velocity"}


def command(mode, values, stamp):
    message = lcmt_panda_command()
    message.utime = round(1e6 * stamp)
    message.control_mode_expected = 2 if mode == "velocity" else 1
    setattr(message, f"joint_{mode}", [float(value) for value in values])
    setattr(message, f"num_joint_{mode}", len(values))
    return message


def word(stamp):
    message = lcmt_panda_command()
    message.utime = round(1e6 * stamp)
    return message


class DrivenRobot:
    """An ArmDrive, and behind it a robot that follows to the letter; `tick` lets a millisecond pass."""

    def __init__(self, mode="position", q=READY, limits=FR3_LIMITS):
        self.mode, self.limits = mode, limits
        self.q, self.v, self.a = np.array(q), np.zeros(7), np.zeros(7)
        self.ticks, self.robot_mode = 0, MOVE
        self.drive = ArmDrive(mode == "velocity", limits)
        self.drive.begin(self.reading())
        self.said, self.path, self.shares = [], [], []
        self.status = None

    @property
    def now(self):
        """Wall time, s."""
        return WALL + self.ticks * TICK

    def reading(self):
        return RobotReading(
            time=ROBOT + self.ticks * TICK,
            mode=self.robot_mode,
            position=self.q,
            velocity=self.v,
            torque=np.zeros(7),
            torque_external=np.zeros(7),
            position_desired=self.q,
            velocity_desired=self.v,
            acceleration_desired=self.a,
            torque_desired=np.zeros(7),
            success_rate=1.0,
        )

    def tick(self, *commands, words=(), late=0.0):
        self.ticks += 1
        output = self.drive.step(self.now + late, self.reading(), commands, words)
        self.said += output.said
        self.status = output.status
        if output.command is not None:
            self.follow(output.command)
        return output

    def follow(self, values):
        v = values if self.mode == "velocity" else (values - self.q) / TICK
        a = (v - self.v) / TICK
        lower, upper = self.limits.velocity_range(self.q)
        self.shares.append(
            [
                np.abs((a - self.a) / TICK / self.limits.jerk).max(),
                np.abs(a / self.limits.acceleration).max(),
                max((v / np.maximum(upper, 1e-3)).max(), (v / np.minimum(lower, -1e-3)).max()),
            ]
        )
        self.q, self.v, self.a = self.q + TICK * v, v, a
        self.path.append(self.q)

    def wait(self, ticks):
        for _ in range(ticks):
            self.tick()
        return self

    def swing(self, seconds, period=5, size=0.1, late=lambda k: 0.0):
        """A sender at 200 Hz moves the arm to and fro; by `late` s its k-th command is under way for longer."""
        self.begun, self.size, start = self.ticks, size, np.array(self.q)
        flying = []
        for k in range(round(1e3 * seconds)):
            if k % period == 0:
                stamp = self.now + TICK
                flying.append((stamp + late(k // period), self.swung(start, stamp)))
            landed = [message for due, message in flying if due <= self.now + TICK + 1e-9]
            flying = [item for item in flying if item[0] > self.now + TICK + 1e-9]
            self.tick(*landed)
        return self

    def planned(self, start, time):
        """Joint angles and velocities at a wall time, s."""
        t, w = time - WALL - self.begun * TICK, 2 * np.pi * 0.5
        axis = self.size * np.sin(1 + np.arange(7))
        rise = 1 - np.exp(-((4 * t) ** 3)) if t > 0 else 0.0
        d_rise = 3 * 4 * (4 * t) ** 2 * np.exp(-((4 * t) ** 3)) if t > 0 else 0.0
        swing, d_swing = np.sin(w * t), w * np.cos(w * t)
        return start + axis * rise * swing, axis * (d_rise * swing + rise * d_swing)

    def swung(self, start, stamp):
        return command(self.mode, self.planned(start, stamp)[int(self.mode == "velocity")], stamp)

    @property
    def largest(self):
        """Shares of the limits of jerk, acceleration and velocity that were used at most."""
        return np.max(self.shares, axis=0)
