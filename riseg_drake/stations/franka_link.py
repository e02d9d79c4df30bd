"""libfranka by its two Python bindings: pylibfranka for the Franka Research 3, panda-python for the Panda.

Each is Apache-2.0 and brings its own libfranka: pylibfranka, of Franka Robotics, version 0.21, which speaks
server version 10; panda-python, of Jean Elsner, 0.9.2, which speaks 5. Both name errors as the robot does. Of
libfranka's smoothing nothing is used: what is sent is within the robot's limits already.

franka-rs speaks both, but its loop in Rust takes targets and makes their motion itself, with other limits and
rules of its own for what ends it: what is tested here as `ArmDrive` would not be what moves the arm.
"""

import re
from collections.abc import Callable
from importlib import import_module
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from riseg_drake.stations.arm_drive import RobotReading

Cycle = Callable[[RobotReading], tuple[NDArray[np.float64], bool]]
"""What the robot said -> what it is to do, rad or rad/s [7], and whether that is the last."""

PACKAGES = {"fr3": "pylibfranka", "panda": "panda-python"}
"""By the robot's name in a scenario; of the same names are the extras that install them."""
_MODULES = {"fr3": "pylibfranka", "panda": "panda_py.libfranka"}
_MODES = {"Other": 0, "Idle": 1, "Move": 2, "Guiding": 3, "Reflex": 4, "UserStopped": 5}
_RECOVERING = 6
_OTHER = {"fr3": "panda", "panda": "fr3"}
_SPEAKS = {"fr3": "a Franka Research 3 (server version 10)", "panda": "a Panda (server version 5)"}
_REFLEX_FORCE, _REFLEX_TORQUE = (
    100.0,
    100.0,
)  # N and N m: the supervisor stops earlier; as drake-franka-driver has it
_VERSIONS = re.compile(  # as libfranka says it, and as panda-python does
    r"(?:[Ss]erver version: |robot speaks protocol version )(\d+)"
    r".*?(?:[Ll]ibrary version: |that speaks version )(\d+)",
    re.S,
)


class LinkError(RuntimeError):
    """There is no robot to be driven; says in one line what is wrong, and what would be right."""


class RobotStopped(RuntimeError):  # noqa: N818 - what a robot does, and not always an error
    """The robot has ended its control, or refuses it; says why, by the names of its errors."""


class Link(Protocol):
    """A connection to a robot; nothing moves but in `control`."""

    system: str
    """Of what version the robot's system is, as far as it says."""

    def read(self) -> RobotReading:
        """What the robot tells next. Raises LinkError where it says nothing any more."""

    def control(self, is_velocity: bool, cycle: Cycle) -> None:
        """Ask `cycle` what to do, each millisecond, until it says that this is the last; from where the arm is.

        Raises RobotStopped, and LinkError where the robot says nothing any more.
        """

    def recover(self) -> None:
        """Have the robot forget its reflex. Raises RobotStopped where it refuses."""

    def load(self) -> tuple[float, NDArray[np.float64]]:
        """Mass, kg, and its centre from the flange, m [3], of hand and load as set in Desk or by `setLoad`."""


class FrankaLink:
    """A robot behind an address; one thread may use it, and no other thread of the process runs meanwhile."""

    def __init__(self, robot: str, address: str):
        """Connect. `robot` is `fr3` or `panda`. Raises LinkError."""
        self._library = _library(robot)
        config = self._library.RealtimeConfig
        try:
            # kEnforce asks for a real-time kernel, and fails where there is none.
            realtime = config.kEnforce if _has_realtime_kernel() else config.kIgnore
            self._robot = self._library.Robot(address, realtime)
        except Exception as error:
            raise LinkError(why_not_connected(robot, address, str(error))) from None
        self._is_panda = robot == "panda"
        spoken = (
            self._robot.server_version() if self._is_panda else 10
        )  # the only one that pylibfranka connects to
        self.system = f"its system speaks server version {spoken}, as the libfranka of {PACKAGES[robot]} does"

    def configure(self) -> None:
        """Set at what forces the robot stops by itself. Raises RobotStopped."""
        torque, force = [_REFLEX_TORQUE] * 7, [_REFLEX_FORCE] * 6
        try:
            if self._is_panda:
                self._robot.set_collision_behavior(torque, torque, torque, torque, force, force, force, force)
            else:
                self._robot.set_collision_behavior(torque, torque, force, force)
        except Exception as error:
            raise RobotStopped(told(error)) from None

    def read(self) -> RobotReading:
        """See Link. Raises LinkError."""
        return reading(self._state())

    def control(self, is_velocity: bool, cycle: Cycle) -> None:
        """See Link. Raises RobotStopped and LinkError."""
        try:
            (self._control_by_callback if self._is_panda else self._control_by_loop)(is_velocity, cycle)
        except Exception as error:
            if _is_stop(error):
                raise RobotStopped(told(error)) from None
            if type(error).__module__.startswith(("pylibfranka", "panda_py")) or type(error) is RuntimeError:
                raise LinkError(f"the robot says nothing any more: {told(error)}") from None
            raise

    def recover(self) -> None:
        """See Link. Raises RobotStopped."""
        try:
            self._robot.automatic_error_recovery()
        except Exception as error:
            raise RobotStopped(told(error)) from None

    def load(self) -> tuple[float, NDArray[np.float64]]:
        """See Link. Raises LinkError."""
        state = self._state()
        return float(state.m_total), np.array(state.F_x_Ctotal, np.float64)

    def _state(self) -> Any:
        try:
            return self._robot.read_once()
        except Exception as error:
            raise LinkError(f"the robot says nothing any more: {told(error)}") from None

    def _control_by_loop(self, is_velocity: bool, cycle: Cycle) -> None:
        robot, library = self._robot, self._library
        start = robot.start_joint_velocity_control if is_velocity else robot.start_joint_position_control
        kind = library.JointVelocities if is_velocity else library.JointPositions
        control = start(
            library.ControllerMode.JointImpedance
        )  # is dropped with this frame: else no other begins
        finished = False
        while not finished:
            state, _ = control.readOnce()
            values, finished = cycle(reading(state))
            command = kind(values.tolist())
            command.motion_finished = finished
            control.writeOnce(command)

    def _control_by_callback(self, is_velocity: bool, cycle: Cycle) -> None:
        robot, library = self._robot, self._library
        kind = library.JointVelocities if is_velocity else library.JointPositions

        def answer(state: Any, _: Any) -> Any:
            values, finished = cycle(reading(state))
            command = kind(values.tolist())
            command.motion_finished = finished
            return command

        run = robot.control_joint_velocity if is_velocity else robot.control_joint_position
        no_filter = 1000.0  # Hz, libfranka's kMaxCutoffFrequency
        run(answer, library.ControllerMode.kJointImpedance, False, no_filter)


def reading(state: Any) -> RobotReading:
    """What a franka::RobotState says."""
    return RobotReading(
        time=state.time.to_sec(),
        mode=_MODES.get(state.robot_mode.name.removeprefix("k"), _RECOVERING),
        position=np.array(state.q, np.float64),
        velocity=np.array(state.dq, np.float64),
        torque=np.array(state.tau_J, np.float64),
        torque_external=np.array(state.tau_ext_hat_filtered, np.float64),
        position_desired=np.array(state.q_d, np.float64),
        velocity_desired=np.array(state.dq_d, np.float64),
        acceleration_desired=np.array(state.ddq_d, np.float64),
        torque_desired=np.array(state.tau_J_d, np.float64),
        success_rate=state.control_command_success_rate,
        errors=_names(state.current_errors) if state.robot_mode.name.endswith("Reflex") else (),
    )


def _names(errors: Any) -> tuple[str, ...]:
    """The names of a franka::Errors that are set."""
    return tuple(name for name in dir(errors) if not name.startswith("_") and getattr(errors, name) is True)


def told(error: BaseException | str) -> str:
    """What libfranka says, in one line without its name; of errors of the robot the names alone."""
    text = " ".join(str(error).split()).removeprefix("libfranka: ")
    names = re.findall(r'"([a-z_0-9]+)"', text)
    return ", ".join(names) or text.removesuffix(".")


def why_not_connected(robot: str, address: str, text: str) -> str:
    """One line on why there is no connection to `robot` at an address, from what libfranka said."""
    versions = _VERSIONS.search(text)
    if versions:
        other = _OTHER[robot]
        return (
            f"the robot at {address} has server version {versions[1]}, and the libfranka of {PACKAGES[robot]} "
            f"speaks version {versions[2]}: {PACKAGES[robot]} is for {_SPEAKS[robot]}; for {_SPEAKS[other]} "
            f"set station.panda.robot: {other} and pip install 'riseg-drake[{other}]', or get the version of "
            f"{PACKAGES[robot]} that Franka's compatibility table names for the robot's system"
        )
    if "scheduling" in text or "realtime" in text.lower():
        return (
            f"this kernel is a real-time one, but the user may not use it: {told(text)}; "
            "allow rtprio 99 in /etc/security/limits.conf"
        )
    return (
        f"no robot at {address}: {told(text)}; is FCI active in Desk, and is this computer in the control "
        "box's network?"
    )


def _library(robot: str) -> Any:
    try:
        return import_module(_MODULES[robot])
    except ImportError:
        python = " with Python 3.11 or 3.12, for which alone there is one" if robot == "fr3" else ""
        other = _OTHER[robot]
        raise LinkError(
            f"station.panda.robot is {robot}, which needs {PACKAGES[robot]}: "
            f"pip install 'riseg-drake[{robot}]'{python}; or set station.panda.robot: {other}"
        ) from None


def _has_realtime_kernel() -> bool:
    try:
        with open("/sys/kernel/realtime") as file:
            return file.read().strip() == "1"
    except OSError:
        return False


def _is_stop(error: Exception) -> bool:
    """Whether the robot itself has spoken; both bindings have libfranka's words."""
    return type(error).__name__ in ("ControlException", "CommandException") or bool(
        re.search(r"aborted|rejected|reflex", str(error))
    )
