"""What arm and camera say on LCM, kept until somebody asks: every status, and the last few pictures."""

import threading
from collections import deque

import numpy as np
from drake import lcmt_image_array
from pydrake.lcm import DrakeLcmInterface

from riseg_drake.robot.command_stream import ArmStatus
from riseg_drake.robot.position_history import PositionHistory
from riseg_drake.robot.supervisor import MOVE
from riseg_drake.stations.arm_messages import AHEAD, BEHIND, PictureDoor, StatusDoor
from riseg_drake.stations.driver_reasons import told_reasons
from riseg_drake.stations.even_clock import EvenClock
from riseg_drake.stations.lcm_channels import LcmConfig
from riseg_drake.stations.lcm_images import ImageError, decode_message

POLL = 0.01
"""Time between two looks for messages, s. Waiting inside LCM would keep Python's lock, and looking more often
would take it from the segmentation again and again. LCM keeps the first message of each channel that comes in
between; of the status one in ten is enough for a straight line."""
KEPT_PICTURES = 4
"""Undecoded pictures kept, half a megabyte each."""


REPLAYED_AHEAD = 1.0
"""So far may stamps of a log be ahead of now, s: its first message may have been late by as much."""
BLIND = 2.0
"""The camera is blind when for this time, s, ..."""
BLIND_PICTURES = 3
"""... and so many in a row no picture could be used."""


class Reception:
    """Listens to a connection, in a thread of its own between `start` and `stop`, or when `listen` is called.

    All times are by `clock`, which goes on evenly. With `replayed`, the first status of a log is of now.
    """

    def __init__(
        self,
        lcm: DrakeLcmInterface,
        config: LcmConfig,
        replayed: bool = False,
        clock: EvenClock | None = None,
    ):
        self._lcm = lcm
        self.clock = clock or EvenClock()
        """What tells the time here, s."""
        self._lock = threading.Lock()
        self._history = PositionHistory()
        self._pictures: deque[tuple[float, bytes]] = deque(maxlen=KEPT_PICTURES)
        self._replayed = replayed
        self._log_shift: float | None = None
        around_now = (REPLAYED_AHEAD, np.inf) if replayed else (AHEAD, BEHIND)  # a log may be played slowly
        self._status_door = StatusDoor(config.status_channel, *around_now)
        self._picture_door = PictureDoor(config.image_channel, *around_now)
        self._unusable, self._last_usable = 0, -np.inf
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self.status: ArmStatus | None = None
        """The newest; None before the first."""
        self.statuses = 0
        """How many have been let in."""
        self.pictures = 0
        """How many have been let in."""
        self.driver_says = ""
        """Why the arm takes no commands, by its driver; empty while it takes some or nothing is said."""
        lcm.Subscribe(config.status_channel, self._take_status)
        lcm.Subscribe(config.errors_channel, self._take_reasons)
        lcm.Subscribe(config.image_channel, self._take_picture)

    @property
    def offset(self) -> float:
        """What is added to the senders' stamps, s: 0 for drivers that are there now, until a clock is set."""
        return (self._log_shift or 0.0) if self._replayed else self.clock.shift()

    @property
    def left_out(self) -> dict[str, int]:
        """How many messages were not let in or not used so far, by channel and kind."""
        doors = (self._status_door.refused, self._picture_door.refused)
        return {f"{door.channel}: {kind}": n for door in doors for kind, n in dict(door.counts).items()}

    def untold(self) -> list[str]:
        """A line for each kind of message that was left out for the first time since the last call."""
        return [*self._status_door.refused.untold(), *self._picture_door.refused.untold()]

    def start(self) -> None:
        """Listen from now on."""
        self._stopping.clear()
        self._thread = threading.Thread(target=self._run, name="LCM reception", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Listen no longer."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()

    def listen(self) -> None:
        """Take in what has come."""
        self._lcm.HandleSubscriptions(0)

    def state_at(self, time: float) -> tuple | None:
        """The arm's position and velocity [7] at a time, s; None where nothing is known of it."""
        with self._lock:
            return self._history.at(time)

    def newest_picture(self, after: float) -> tuple[float, lcmt_image_array] | None:
        """The newest message sent later than `after`, s, behind the time at which it was sent.

        One that is cut off is left out; see `skip`, also for errors.
        """
        with self._lock:
            pictures = sorted(self._pictures, key=lambda picture: picture[0], reverse=True)
        for sent, data in pictures:
            if sent <= after:
                break
            try:
                return sent, decode_message(data)
            except ImageError as error:
                self.skip(sent, error)
        return None

    def skip(self, sent: float, error: ImageError) -> None:
        """Leave out a picture, by the time at which it was sent, s, that cannot be used because of an error.

        Raises that error when the camera is blind: when nothing else has come for a while.
        """
        now = self.clock()
        with self._lock:
            kept = [picture for picture in self._pictures if picture[0] != sent]
            self._pictures.clear()
            self._pictures.extend(kept)
        self._picture_door.refused.add("a picture that cannot be used", str(error))
        if not self._unusable:
            self._last_usable = now
        self._unusable += 1
        if self._unusable >= BLIND_PICTURES and now - self._last_usable >= BLIND:
            raise error

    def used(self) -> None:
        """A picture was good: the camera is not blind."""
        self._unusable = 0

    def _run(self) -> None:
        while not self._stopping.wait(POLL):
            self.listen()

    def _take_status(self, data: bytes) -> None:  # LCM calls this from C: nothing may be raised
        now = self.clock()
        if self._replayed and self._log_shift is None:
            message = self._status_door.opened(data)
            if message is None:
                return
            self._log_shift = now - 1e-6 * message.utime
        status = self._status_door.admit(data, now, self.offset)
        if status is None:
            return
        with self._lock:
            self._history.add(status.time, status.position, status.velocity)
        self.status = status
        self.statuses += 1
        if status.robot_mode == MOVE:
            self.driver_says = ""

    def _take_reasons(self, data: bytes) -> None:
        self.driver_says = told_reasons(data)

    def _take_picture(self, data: bytes) -> None:
        if self._replayed and self._log_shift is None:
            return
        sent = self._picture_door.admit(data, self.clock(), self.offset)
        if sent is not None:
            with self._lock:
                self._pictures.append((sent, data))
            self.pictures += 1
