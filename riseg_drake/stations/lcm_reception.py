"""What arm and camera say on LCM, kept until somebody asks: every status, and the last few pictures."""

import struct
import threading
import time
from collections import deque
from collections.abc import Callable

import numpy as np
from drake import lcmt_image_array, lcmt_panda_status
from pydrake.lcm import DrakeLcmInterface

from riseg_drake.robot.command_stream import ArmStatus
from riseg_drake.robot.position_history import PositionHistory
from riseg_drake.stations.lcm_channels import LcmConfig

POLL = 0.01
"""Time between two looks for messages, s. Waiting inside LCM would keep Python's lock, and looking more often
would take it from the segmentation again and again. LCM keeps the first message of each channel that comes in
between; of the status one in ten is enough for a straight line."""
KEPT_PICTURES = 4
"""Undecoded pictures kept, half a megabyte each."""


def status_of(message: lcmt_panda_status) -> ArmStatus:
    """The part of the driver's status that this program depends on."""
    return ArmStatus(
        time=message.utime * 1e-6,
        position=np.array(message.joint_position),
        velocity=np.array(message.joint_velocity),
        torque_external=np.array(message.joint_torque_external),
        robot_mode=message.robot_mode,
    )


def array_time(data: bytes) -> float:
    """The stamp of an encoded lcmt_image_array, s, without decoding its pictures.

    It follows LCM's fingerprint of 8 bytes and the sequence number of 4.
    """
    (utime,) = struct.unpack_from(">q", data, 12)
    return utime * 1e-6


class Reception:
    """Listens to a connection, in a thread of its own between `start` and `stop`, or when `listen` is called.

    `offset` is added to every stamp, s: 0 for drivers that are there now. With `replayed`, it becomes the
    time that has passed since a log was recorded, by the first status.
    """

    def __init__(
        self,
        lcm: DrakeLcmInterface,
        config: LcmConfig,
        replayed: bool = False,
        clock: Callable[[], float] = time.time,
    ):
        self._lcm = lcm
        self._clock = clock
        self._lock = threading.Lock()
        self._history = PositionHistory()
        self._pictures: deque[bytes] = deque(maxlen=KEPT_PICTURES)
        self._offset: float | None = None if replayed else 0.0
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self.status: ArmStatus | None = None
        """The newest; None before the first."""
        self.statuses = 0
        """How many have come."""
        self.pictures = 0
        """How many have come."""
        lcm.Subscribe(config.status_channel, self._take_status)
        lcm.Subscribe(config.image_channel, self._take_picture)

    @property
    def offset(self) -> float:
        """What is added to the senders' stamps, s."""
        return self._offset or 0.0

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

    def newest_picture(self, after: float) -> lcmt_image_array | None:
        """The newest message sent later than `after`, s by its own stamp with the offset."""
        candidates = [data for data in tuple(self._pictures) if array_time(data) + self.offset > after]
        return lcmt_image_array.decode(max(candidates, key=array_time)) if candidates else None

    def _run(self) -> None:
        while not self._stopping.wait(POLL):
            self.listen()

    def _take_status(self, data: bytes) -> None:  # LCM calls this from C: nothing may be raised
        try:
            status = status_of(lcmt_panda_status.decode(data))
        except Exception:  # whatever the decoder makes of bytes that are no status; the arm says more soon
            return
        if self._offset is None:
            self._offset = self._clock() - status.time
        status = status.shifted(self._offset)
        with self._lock:
            self._history.add(status.time, status.position, status.velocity)
        if self.status is None or status.time > self.status.time:
            self.status = status
        self.statuses += 1

    def _take_picture(self, data: bytes) -> None:
        if self._offset is not None and len(data) > 24:
            self._pictures.append(data)
            self.pictures += 1
