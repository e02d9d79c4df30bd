"""Both drivers as they behave on LCM, each around its half of the simulated world."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from drake import lcmt_panda_command
from numpy.typing import NDArray
from pydrake.lcm import DrakeLcmInterface

from riseg_drake.stations.emulated_arm import TICK_US, EmulatedArm
from riseg_drake.stations.emulated_camera import EmulatedCamera
from riseg_drake.stations.ground_truth import LABEL_CHANNEL, POSE_CHANNEL, encode_labels, encode_poses
from riseg_drake.stations.lcm_channels import LcmConfig
from riseg_drake.stations.lcm_images import encode_images
from riseg_drake.stations.misbehaviour import CONTROL_CHANNEL, UnreliableLink, Word, WordError, parse_word
from riseg_drake.stations.panda_driver import DriverEnd, PandaDriverConfig

_LONGEST_CATCHING_UP = 50_000  # us; if this process was kept from running for longer, time is skipped
_QUIET = 10_000_000  # us, until it is said again that time was skipped


@dataclass
class EmulatorConfig:
    """How the emulated drivers were started."""

    lcm: LcmConfig = field(default_factory=LcmConfig)
    """Network and channels."""
    driver: PandaDriverConfig = field(default_factory=PandaDriverConfig)
    """The arm's driver."""
    rate: float = field(default=5.0, metadata={"least": 0.1, "most": 120.0})
    """Pictures a second at most; fewer come where drawing takes longer. Two cores also have to run what looks
    at them, and the arm, which cannot wait."""
    software_depth_registration: bool = True
    """The camera driver's flag of that name: whether aligned depth is published."""
    ir: bool = False
    """The camera driver's flag of that name (there it is on by default): whether infrared is published."""


class _Ears:
    """Hears the words on the control channel, and keeps what there is to tell the operator.

    `faults` are words that hold from the start. They do not come by LCM, which keeps one message of a burst.
    """

    def __init__(self, lcm: DrakeLcmInterface, faults: Sequence[str]):
        self._words = [parse_word(text) for text in faults]
        self._notes: list[str] = []
        lcm.Subscribe(CONTROL_CHANNEL, self._hear)

    def _hear(self, raw: bytes) -> None:  # LCM calls this from C: nothing may be raised
        try:
            self._words.append(parse_word(raw.decode(errors="replace")))
        except WordError as error:
            self._notes.append(str(error))

    def words(self, *subjects: str) -> Iterator[Word]:
        """What was said about these subjects since the last call; all else is for others."""
        said, self._words = self._words, []
        return (word for word in said if word.subject in subjects)

    def note(self, text: str) -> None:
        """Something to tell."""
        self._notes.append(text)

    def notes(self) -> list[str]:
        """What there is to tell since the last call."""
        notes, self._notes = self._notes, []
        return notes


class PandaSide:
    """The arm's driver: commands in, status out, around the physics of the world.

    While the driver's process is not there nothing is said or heard; the world goes on. `faults` are words that
    hold from the start. Raises WordError.
    """

    def __init__(
        self,
        lcm: DrakeLcmInterface,
        config: EmulatorConfig,
        arm: EmulatedArm,
        seed: int,
        faults: Sequence[str] = (),
    ):
        self.arm = arm
        self.published = 0
        """Status messages so far."""
        self._lcm = lcm
        self._channel = config.lcm.status_channel
        self._link = UnreliableLink(np.random.default_rng([seed, 1]))
        self._ears = _Ears(lcm, faults)
        self._restarts_at: int | None = None
        self._was_connected = True
        self._told: DriverEnd | None = None
        self._skipped_us = 0
        """Since that was told, and when and at which number of status messages it was."""
        self._told_at: tuple[int, int] | None = None  # before the first tick: its start is no measure
        lcm.Subscribe(config.lcm.command_channel, self._hear)

    def _hear(self, raw: bytes) -> None:  # LCM calls this from C: nothing may be raised
        try:
            command = lcmt_panda_command.decode(raw)
        except Exception as error:  # whatever the decoder makes of bytes that are no command
            self._ears.note(f"a message that is no lcmt_panda_command was ignored ({error})")
            return
        self.arm.driver.receive(command)

    def notes(self) -> list[str]:
        """What happened since the last call, a line each."""
        return self._ears.notes()

    def advance(self, wall_us: int) -> None:
        """Let the world come up to a wall time, microseconds, and publish the status of its last tick."""
        now = 1e-6 * wall_us
        behind = wall_us - self.arm.wall_us
        if abs(behind) > _LONGEST_CATCHING_UP:  # or the clock was set
            self.arm.skip(behind - TICK_US)
            self._skipped_us += max(0, behind)
        if not self._link.is_stalled(now):
            self._lcm.HandleSubscriptions(0)
        for word in self._ears.words("arm", "status"):
            self._obey(word, wall_us)
        if self._restarts_at is not None and wall_us >= self._restarts_at:
            self._restarts_at = None
            self.arm.driver.robot.recover()
            self._start(wall_us)
        ticks = 0
        while self.arm.wall_us + TICK_US <= wall_us:
            self.arm.tick()
            ticks += 1
        self._tell()
        self._tell_skipped(wall_us)
        if ticks and self.arm.driver.is_connected:
            self._link.send(self.arm.status().encode(), now)
        for message in self._link.due(now):
            self._lcm.Publish(self._channel, message)
            self.published += 1

    def _obey(self, word: Word, wall_us: int) -> None:
        driver, robot = self.arm.driver, self.arm.driver.robot
        match word.subject, word.verb:
            case "status", _:
                self._link.obey(word, 1e-6 * wall_us)
            case _, "reflex":
                robot.enter_reflex("asked for")
            case _, "stop":
                robot.user_stop()
            case _, "recover":
                robot.recover()
                self._ears.note(f"robot_mode is {robot.mode}")
            case _, "start":
                self._start(wall_us)
            case _, "guide":
                self._guide(np.array(word.posture))
            case _, "die":
                driver.kill()
                self._restarts_at = wall_us + int(1e6 * word.amount) if word.amount else None

    def _start(self, wall_us: int) -> None:
        is_new = self.arm.driver.start(wall_us)
        self._ears.note("the driver is starting" if is_new else "the driver is there already")

    def _guide(self, posture: NDArray) -> None:
        robot = self.arm.driver.robot
        goal = robot.q_d.copy()
        if len(posture) == 2:
            goal[int(posture[0]) - 1] += posture[1]
        else:
            goal = posture
        try:
            robot.guide(goal)
            self._ears.note("the arm is guided by hand")
        except ValueError as error:
            self._ears.note(f"the arm is not guided: {error}")

    def _tell(self) -> None:
        """Note when the driver has come, or gone."""
        driver = self.arm.driver
        if driver.end is not None and driver.end is not self._told:
            self._told = driver.end
            self._ears.note(f"the driver ended, {driver.end}; say 'start' to start it again")
        if driver.is_connected and not self._was_connected:
            self._ears.note(f"the driver is back, robot_mode is {driver.robot.mode}")
        self._was_connected = driver.is_connected

    def _tell_skipped(self, wall_us: int) -> None:
        """Note that this computer is too slow, and which rate is reached."""
        if self._told_at is None:
            self._skipped_us, self._told_at = 0, (wall_us, self.published)
        since, published = self._told_at
        elapsed = wall_us - since
        if elapsed < _QUIET:
            return
        if self._skipped_us:
            rate = 1e6 * (self.published - published) / elapsed
            self._ears.note(
                f"this computer is too slow: {1e-6 * self._skipped_us:.1f} of the last {1e-6 * elapsed:.0f} s "
                f"were skipped, and the arm's status came at {rate:.0f} Hz; fewer pictures (`emulator.rate`, "
                "but more than 2 a second, else the arm pauses for late ones) leave more for the arm"
            )
        self._skipped_us, self._told_at = 0, (wall_us, self.published)


@dataclass(frozen=True)
class Moment:
    """The world at one moment, as the arm's side hands it to the camera's."""

    wall_us: int
    """Wall time, microseconds."""
    positions: NDArray[np.float64]
    """[num_positions], of all joints and bodies, in the plant's order."""
    is_standing: bool
    """Whether the arm stands still."""


class CameraSide:
    """The camera's driver: pictures out, and the truth about them on channels of its own.

    `faults` are words that hold from the start. Raises WordError.
    """

    def __init__(
        self,
        lcm: DrakeLcmInterface,
        config: EmulatorConfig,
        camera: EmulatedCamera,
        seed: int,
        faults: Sequence[str] = (),
    ):
        self.published = 0
        """Pictures so far, before any went astray."""
        self._lcm = lcm
        self._config = config
        self._camera = camera
        self._link = UnreliableLink(np.random.default_rng([seed, 2]))
        self._ears = _Ears(lcm, faults)

    def show(self, moment: Moment, now: float) -> None:
        """Take a picture of the world as it was at a moment; `now` is the wall time, s."""
        self._camera.look(moment.positions)
        picture = self._camera.picture(self.published)
        shape = picture.depth.shape
        infrared = {name: picture.color[..., 1].reshape(shape) for name in ("infrared", "infrared_stereo")}
        message = encode_images(
            picture.color,
            picture.depth if self._config.software_depth_registration else None,
            time=1e-6 * moment.wall_us,
            sent=now,
            sequence=self.published,
            raw_depth=picture.raw_depth,
            infrared=infrared if self._config.ir else None,
        )
        stamp_ms = message.images[0].header.utime
        if moment.is_standing:  # a third of the time that a picture takes; nobody scores masks on the way
            labels = encode_labels(self._camera.labels(), stamp_ms, self.published)
            self._lcm.Publish(LABEL_CHANNEL, labels.encode())
        camera = self._camera
        poses = encode_poses(camera.names, camera.object_poses(), camera.axes, stamp_ms)
        self._lcm.Publish(POSE_CHANNEL, poses.encode())
        self._link.send(message.encode(), now)
        self.published += 1

    def flush(self, now: float) -> float:
        """Publish what has arrived by `now`, s, and listen; returns when more will arrive, s, or inf."""
        self._lcm.HandleSubscriptions(0)
        for word in self._ears.words("images"):
            self._link.obey(word, now)
        for message in self._link.due(now):
            self._lcm.Publish(self._config.lcm.image_channel, message)
        return self._link.next_arrival()
