"""The door for messages of the arm and of the camera: what they say is believed if it can be true.

Both who commands the arm and who looks at pictures let messages in here. What is refused is left out, counted
by kind, and told once of each kind; the arm then has no news, and stops once the last is too old. So a force,
a mode or a place that is no number can never pass for one without danger.
"""

import struct
from collections import Counter, deque

import numpy as np
from drake import lcmt_image_array, lcmt_panda_status
from numpy.typing import NDArray

from riseg_drake.robot.command_stream import ArmStatus
from riseg_drake.robot.limits import ROBOTS

AHEAD = 0.02
"""A stamp may be ahead of now by this much, s: clocks that chrony or PTP keeps agree to a few milliseconds.
An age is never negative, so this is also what a wrong clock can hide of it: a fifth of what is too old."""
BEHIND = 5.0
"""A stamp that is further behind is of another clock, s: no network keeps a message for so long."""
CONTINUOUS = 0.1
"""A status that follows another within this time, s, must be of the same arm: it cannot have jumped. After a
longer silence the driver may have been started anew, and the arm been moved by hand."""
FASTER = 1.5
"""No joint is faster than this many times the greatest speed of any robot known here."""
SLACK = 0.01
"""How much joint angles may differ beyond that, rad: their noise, and stamps that are 2 ms off at 5 rad/s."""
ROBOT_CLOCK = 1.0
"""The robot's own clock may gain this much on the driver's from one status to the next, s."""
CONTRADICTIONS, WITHIN = 3, 0.5
"""So many contradictions in this time, s, are no damaged message any more but a second sender."""
BEYOND = 0.5
"""A joint angle may be this far out of the widest range of any robot known here, rad: joints end at stops that
are some hundredths of a radian out."""
TORQUE = 10.0
"""External torques are at most this many times what the strongest robot's joints can bear."""

STATUS_BYTES = 486
"""Of an encoded lcmt_panda_status with seven joints."""
PICTURE_BYTES = 29
"""Of an encoded lcmt_image_array without a name and without pictures."""

_ONE_TIME = "computers of drivers and program must agree on the time, as by chrony or PTP"
_ROBOTS = tuple(ROBOTS.values())
_LOWEST = np.min([robot.position_lower for robot in _ROBOTS], axis=0) - BEYOND
_HIGHEST = np.max([robot.position_upper for robot in _ROBOTS], axis=0) + BEYOND
_FASTEST = FASTER * np.max([robot.velocity for robot in _ROBOTS], axis=0)
_STRONGEST = TORQUE * np.max([robot.effort for robot in _ROBOTS], axis=0)
_MODES = range(lcmt_panda_status.kOther, lcmt_panda_status.kAutomaticErrorRecovery + 1)
_STATUS_FINGERPRINT = lcmt_panda_status._get_packed_fingerprint()
_PICTURE_FINGERPRINT = lcmt_image_array._get_packed_fingerprint()


class Refusals:
    """What was left out on one channel, by kind."""

    def __init__(self, channel: str):
        self.channel = channel
        self._untold: list[str] = []
        self.counts: Counter[str] = Counter()
        """How many messages, by a few words on what was wrong with them."""

    def add(self, kind: str, detail: str = "") -> None:
        """Count one; the first of its kind is to be told, with `detail`."""
        if kind not in self.counts:
            self._untold.append(f"{self.channel}: a message was left out: {kind}{detail and f' ({detail})'}")
        self.counts[kind] += 1

    def untold(self) -> list[str]:
        """A line for each kind that is new since the last call."""
        lines, self._untold = self._untold, []
        return lines


class StatusDoor:
    """Lets in what the arm's driver can have said. Never raises."""

    def __init__(self, channel: str = "PANDA_STATUS", ahead: float = AHEAD, behind: float = BEHIND):
        self._ahead, self._behind = ahead, behind
        self._newest: ArmStatus | None = None
        self._robot_time = 0.0
        self._contradictions: deque[float] = deque(maxlen=CONTRADICTIONS)
        self.refused = Refusals(channel)

    def admit(self, data: bytes, now: float, shift: float) -> ArmStatus | None:
        """The status in a message, if it is one and news; None if it is left out.

        `now` is the time by the clock of whoever asks, s, and the status tells its own time by it; `shift` is
        what has to be added to a stamp, s.
        """
        message = self.opened(data)
        if message is None:
            return None
        time = 1e-6 * message.utime + shift
        if not self._is_in_time(time, now):
            return None
        position, velocity, torque = (
            np.array(values)
            for values in (message.joint_position, message.joint_velocity, message.joint_torque_external)
        )
        robot_time = 1e-6 * message.robot_utime
        if self._newest is not None and time - self._newest.time <= CONTINUOUS:
            elapsed = time - self._newest.time
            reach = _FASTEST * elapsed + SLACK
            same = (np.abs(position - self._newest.position) <= reach).all()
            if not (same and 0 <= robot_time - self._robot_time <= elapsed + ROBOT_CLOCK):
                self._contradictions.append(now)
                self.refused.add("it contradicts the one before, as if two drivers sent on this channel")
                return None
        self._robot_time = robot_time
        self._newest = ArmStatus(time, position, velocity, torque, message.robot_mode)
        return self._newest

    def opened(self, data: bytes) -> lcmt_panda_status | None:
        """The message, if all that is used of it can be true at some time."""
        flaw = _flaw_of_bytes(data)
        if flaw is None:
            message = lcmt_panda_status.decode(data)
            flaw = _flaw_of_values(message)
            if flaw is None:
                return message
        self.refused.add(*flaw)
        return None

    def contradicts_itself(self, now: float) -> bool:
        """Whether there seem to be two arms, or two drivers, at a time, s."""
        return len(self._contradictions) == CONTRADICTIONS and now - self._contradictions[0] <= WITHIN

    def _is_in_time(self, time: float, now: float) -> bool:
        if not _is_of_now(time - now, self._ahead, self._behind, self.refused):
            return False
        if self._newest is None or time > self._newest.time:
            return True
        if time < self._newest.time:  # not one that simply came twice
            self.refused.add("it came after a later one")
        return False


class PictureDoor:
    """Lets in what the camera's driver can have sent, as far as its first bytes tell. Never raises."""

    def __init__(self, channel: str = "the camera", ahead: float = AHEAD, behind: float = BEHIND):
        self._ahead, self._behind = ahead, behind
        self.newest = -np.inf
        """When the newest that was let in was sent, s."""
        self.refused = Refusals(channel)

    def admit(self, data: bytes, now: float, shift: float) -> float | None:
        """When a message was sent, s, by the clock of `now`; None if it is left out. See StatusDoor."""
        if len(data) < PICTURE_BYTES or data[:8] != _PICTURE_FINGERPRINT:
            self.refused.add("it is no lcmt_image_array")
            return None
        sent = array_time(data) + shift
        if not _is_of_now(sent - now, self._ahead, self._behind, self.refused):
            return None
        if sent < self.newest:
            self.refused.add("it came after a later one")
            return None
        self.newest = sent
        return sent


def array_time(data: bytes) -> float:
    """The stamp of an encoded lcmt_image_array, s, without decoding its pictures.

    It follows LCM's fingerprint of 8 bytes and the sequence number of 4.
    """
    (utime,) = struct.unpack_from(">q", data, 12)
    return utime * 1e-6


def _flaw_of_bytes(data: bytes) -> tuple[str, str] | None:
    """What is wrong with the form of a status, in a few words and in detail; None if nothing is."""
    if len(data) < 20 or data[:8] != _STATUS_FINGERPRINT:
        return "it is no lcmt_panda_status", f"{len(data)} bytes"
    (joints,) = struct.unpack_from(">i", data, 16)
    if joints != 7:
        return "it is not of seven joints", f"num_joints is {joints}"
    if len(data) != STATUS_BYTES:
        return "it is too short or too long", f"{len(data)} bytes, not {STATUS_BYTES}"
    return None


def _flaw_of_values(message: lcmt_panda_status) -> tuple[str, str] | None:
    """The same for what it says. Comparisons are such that NaN fails them."""
    q, v, torque = message.joint_position, message.joint_velocity, message.joint_torque_external
    if not np.isfinite([q, v, torque]).all():
        return "joint angles, velocities or external torques that are no numbers", _listed(q + v + torque)
    if not _all_within(q, _LOWEST, _HIGHEST):
        return "joint angles that no arm has", f"{_listed(q)} rad"
    if not _all_within(v, -_FASTEST, _FASTEST):
        return "velocities that no arm has", f"{_listed(v)} rad/s"
    if not _all_within(torque, -_STRONGEST, _STRONGEST):
        return "external torques that no arm has", f"{_listed(torque)} N m"
    if message.robot_mode not in _MODES:
        return "a robot_mode that is not known", str(message.robot_mode)
    return None


def _is_of_now(since: float, ahead: float, behind: float, refused: Refusals) -> bool:
    """Whether a stamp, of `since` s after now, can be of about now."""
    if since > ahead:
        refused.add("its stamp is ahead of this computer's clock", f"by {since:.3f} s; {_ONE_TIME}")
    elif since < -behind:
        refused.add("its stamp is far behind this computer's clock", f"by {-since:.1f} s; {_ONE_TIME}")
    return -behind <= since <= ahead


def _all_within(values: tuple, lower: NDArray, upper: NDArray) -> bool:
    array = np.array(values)
    return bool(((lower <= array) & (array <= upper)).all())


def _listed(values: tuple) -> str:
    return ", ".join(f"{value:.3g}" for value in values)
