import sys
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from riseg_drake.stations import franka_link
from riseg_drake.stations.franka_link import FrankaLink, LinkError, RobotStopped, told, why_not_connected

ROBOTS = ("fr3", "panda")
MODULES = {"fr3": "pylibfranka", "panda": "panda_py.libfranka"}
FIELDS = {  # of lcmt_panda_status and RobotReading -> of franka::RobotState, by libfranka's documentation
    "position": "q",
    "velocity": "dq",
    "torque": "tau_J",
    "torque_external": "tau_ext_hat_filtered",
    "position_desired": "q_d",
    "velocity_desired": "dq_d",
    "acceleration_desired": "ddq_d",
    "torque_desired": "tau_J_d",
}


class Values(list):
    """Joint angles or velocities that a robot was told."""

    motion_finished = False


class ControlException(Exception):  # noqa: N818 - libfranka's name
    """As both bindings call it."""


class Library:
    """pylibfranka or panda_py.libfranka, as far as they are used here; its robot notes what it is asked."""

    def __init__(self, robot, refusal=None):
        self.is_panda, self.refusal, self.asked, self.sent, self.ends = robot == "panda", refusal, [], [], None
        self.RealtimeConfig = SimpleNamespace(kEnforce="enforce", kIgnore="ignore")
        self.ControllerMode = SimpleNamespace(JointImpedance="impedance", kJointImpedance="impedance")
        self.JointPositions = lambda values: self.made("positions", values)
        self.JointVelocities = lambda values: self.made("velocities", values)
        self.mode, self.errors, self.time = "Idle", (), 4.0

    def made(self, kind, values):
        self.kind = kind
        return Values(values)

    def Robot(self, address, realtime):
        self.asked.append((address, realtime))
        if self.refusal:
            raise RuntimeError(self.refusal)
        return self

    def refused(self):
        if self.ends is not None:
            raise self.ends

    def server_version(self):
        return 5

    def set_collision_behavior(self, *thresholds):
        self.refused()
        self.asked.append(thresholds)

    def automatic_error_recovery(self):
        self.refused()
        self.asked.append("recovery")

    def state(self):
        self.time += 0.001
        prefix = "k" if self.is_panda else ""
        rows = {name: [100.0 * k + i for i in range(7)] for k, name in enumerate(FIELDS.values())}
        errors = {"joint_reflex": False, "power_limit_violation": False, **dict.fromkeys(self.errors, True)}
        return SimpleNamespace(
            **rows,
            time=SimpleNamespace(to_sec=lambda time=self.time: time),
            robot_mode=SimpleNamespace(name=prefix + self.mode),
            control_command_success_rate=0.75,
            current_errors=SimpleNamespace(**errors),
            m_total=0.9,
            F_x_Ctotal=[0.1, 0.2, 0.3],
        )

    def read_once(self):
        self.refused()
        return self.state()

    def start(self, kind, controller):
        self.asked.append((kind, controller))
        return self

    def start_joint_position_control(self, controller):
        return self.start("position", controller)

    def start_joint_velocity_control(self, controller):
        return self.start("velocity", controller)

    def readOnce(self):
        self.refused()
        return self.state(), None

    def writeOnce(self, values):
        self.sent.append((self.kind, list(values), values.motion_finished))

    def callback(self, kind, answer, controller, limit_rate, cutoff):
        self.asked.append((kind, controller, limit_rate, cutoff))
        finished = False
        while not finished:
            self.refused()
            values = answer(self.state(), None)
            self.writeOnce(values)
            finished = values.motion_finished

    def control_joint_position(self, *asked):
        self.callback("position", *asked)

    def control_joint_velocity(self, *asked):
        self.callback("velocity", *asked)


@pytest.fixture
def library(robot, monkeypatch):
    stand_in = Library(robot)
    monkeypatch.setitem(sys.modules, MODULES[robot], stand_in)
    if robot == "panda":
        monkeypatch.setitem(sys.modules, "panda_py", SimpleNamespace(libfranka=stand_in))
    return stand_in


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("is_realtime", [False, True])
def test_real_time_is_enforced_where_the_kernel_can(robot, is_realtime, library, monkeypatch):
    monkeypatch.setattr(franka_link, "_has_realtime_kernel", lambda: is_realtime)
    link = FrankaLink(robot, "172.16.0.2")
    assert library.asked == [("172.16.0.2", "enforce" if is_realtime else "ignore")]
    version = {"fr3": 10, "panda": 5}[robot]
    assert f"server version {version}," in link.system


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_robot_is_set_to_stop_at_100_newtons_and_newton_metres_in_each_direction(robot, library):
    link = FrankaLink(robot, "172.16.0.2")
    link.configure()
    torques, forces = [100.0] * 7, [100.0] * 6
    times = 4 if robot == "panda" else 2  # a Panda has thresholds of its own while it accelerates
    assert library.asked[1] == (*[torques] * times, *[forces] * times)
    library.ends = RuntimeError("libfranka: Set Collision Behavior command rejected!")
    with pytest.raises(RobotStopped, match=r"^Set Collision Behavior command rejected!$"):
        link.configure()


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_field_of_the_robots_state_is_read_as_libfranka_names_it(robot, library):
    link = FrankaLink(robot, "172.16.0.2")
    reading = link.read()
    for k, name in enumerate(FIELDS):
        np.testing.assert_array_equal(getattr(reading, name), 100.0 * k + np.arange(7))
    assert (reading.time, reading.mode, reading.success_rate, reading.errors) == (4.001, 1, 0.75, ())
    mass, center = link.load()
    assert mass == 0.9
    np.testing.assert_array_equal(center, [0.1, 0.2, 0.3])
    library.ends = RuntimeError("libfranka: UDP receive: Timeout")
    for ask in (link.read, link.load):
        with pytest.raises(LinkError, match=r"^the robot says nothing any more: UDP receive: Timeout$"):
            ask()


@pytest.mark.parametrize("robot", ROBOTS)
def test_errors_are_read_by_name_while_the_robot_is_in_its_reflex(robot, library):
    library.errors = ("joint_reflex",)
    link = FrankaLink(robot, "172.16.0.2")
    assert link.read().errors == ()
    library.mode = "Reflex"
    assert (link.read().mode, link.read().errors) == (4, ("joint_reflex",))


@pytest.mark.parametrize("robot", ROBOTS)
def test_modes_have_the_numbers_that_the_robots_own_library_gives_them(robot):
    try:
        library = import_module(MODULES[robot])
    except ImportError as error:
        pytest.skip(f"pip install 'riseg-drake[{robot}]': {error}")
    for name, mode in library.RobotMode.__members__.items():
        state = Library(robot)
        state.mode = name.removeprefix("k")
        assert franka_link.reading(state.state()).mode == int(mode)
    missing = [
        name for name in (*FIELDS.values(), "m_total", "F_x_Ctotal") if not hasattr(library.RobotState, name)
    ]
    assert missing == []


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize(("is_velocity", "kind"), [(False, "position"), (True, "velocity")])
def test_what_a_cycle_answers_reaches_the_robot_unfiltered_until_the_last(robot, is_velocity, kind, library):
    times = []

    def cycle(reading):
        times.append(reading.time)
        return np.full(7, 0.1 * len(times)), len(times) == 3

    FrankaLink(robot, "172.16.0.2").control(is_velocity, cycle)
    unfiltered = (False, 1000.0) if robot == "panda" else ()
    assert library.asked[1] == (kind, "impedance", *unfiltered)
    kinds = {"position": "positions", "velocity": "velocities"}[kind]
    assert library.sent == [(kinds, [0.1 * k] * 7, k == 3) for k in (1, 2, 3)]
    np.testing.assert_allclose(times, [4.001, 4.002, 4.003])


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize(
    ("error", "raised", "words"),
    [
        (ControlException('libfranka: motion aborted! ["joint_reflex"]'), RobotStopped, "joint_reflex"),
        (RuntimeError("libfranka: Move command rejected: user stop"), RobotStopped, "rejected"),
        (
            RuntimeError("libfranka: UDP receive: Timeout"),
            LinkError,
            "says nothing any more: UDP receive: Timeout",
        ),
        (ZeroDivisionError("a mistake of ours"), ZeroDivisionError, "a mistake of ours"),
    ],
)
def test_a_control_ends_as_what_ended_it(robot, error, raised, words, library):
    library.ends = error
    link = FrankaLink(robot, "172.16.0.2")
    with pytest.raises(raised, match=words):
        link.control(False, lambda reading: (np.zeros(7), True))


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_recovery_that_is_refused_is_told_as_that(robot, library):
    link = FrankaLink(robot, "172.16.0.2")
    link.recover()
    assert library.asked[1:] == ["recovery"]
    library.ends = RuntimeError(
        'libfranka: Automatic error recovery command aborted: ["joint_position_limits_violation"]'
    )
    with pytest.raises(RobotStopped, match=r"^joint_position_limits_violation$"):
        link.recover()


@pytest.mark.parametrize("robot", ROBOTS)
def test_where_there_is_no_robot_the_line_says_what_to_look_at(robot, library):
    library.refusal = "libfranka: Connection to FCI refused. Please enable FCI mode in Desk."
    with pytest.raises(LinkError) as caught:
        FrankaLink(robot, "172.16.0.9")
    assert str(caught.value) == (
        "no robot at 172.16.0.9: Connection to FCI refused. Please enable FCI mode in Desk; is FCI active in "
        "Desk, and is this computer in the control box's network?"
    )


def test_without_the_right_to_real_time_the_line_says_where_to_allow_it():
    text = "libfranka: unable to set realtime scheduling: Operation not permitted"
    assert why_not_connected("fr3", "172.16.0.2", text).endswith("allow rtprio 99 in /etc/security/limits.conf")


@pytest.mark.parametrize(("robot", "package"), [("fr3", "pylibfranka"), ("panda", "panda-python")])
def test_a_library_that_is_missing_is_told_with_the_line_that_installs_it(robot, package, monkeypatch):
    for module in ("pylibfranka", "panda_py", "panda_py.libfranka"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(LinkError) as caught:
        FrankaLink(robot, "127.0.0.1")
    python = {"fr3": " with Python 3.11 or 3.12, for which alone there is one", "panda": ""}[robot]
    other = {"fr3": "panda", "panda": "fr3"}[robot]
    assert str(caught.value) == (
        f"station.panda.robot is {robot}, which needs {package}: pip install 'riseg-drake[{robot}]'{python}; "
        f"or set station.panda.robot: {other}"
    )


LIBFRANKA = (
    "libfranka: Incompatible library version (server version: {}, library version: {}). "
    "Please check https://frankarobotics.github.io for Panda systems."
)
PANDA_PYTHON = (
    "The robot speaks protocol version {}, but this panda-py was built with a libfranka that speaks "
    "version {}. Install the panda-py build for another libfranka instead."
)


@pytest.mark.parametrize(
    ("robot", "server", "library", "remedy", "text"),
    [
        ("fr3", 5, 10, "panda", LIBFRANKA),
        ("panda", 10, 5, "fr3", LIBFRANKA),
        ("panda", 10, 5, "fr3", PANDA_PYTHON),
        ("fr3", 11, 10, "table", LIBFRANKA),
    ],
)
def test_another_version_is_one_line_with_both_and_what_to_do(robot, server, library, remedy, text):
    line = why_not_connected(robot, "172.16.0.2", text.format(server, library))
    assert "\n" not in line
    assert f"has server version {server}," in line
    assert f"speaks version {library}:" in line
    assert remedy in line


def test_errors_of_the_robot_are_told_by_their_names_alone():
    text = (
        'libfranka: Move command aborted: motion aborted by reflex! ["joint_reflex", "power_limit_violation"]'
    )
    assert told(text) == "joint_reflex, power_limit_violation"
    assert told("libfranka: UDP receive: Timeout") == "UDP receive: Timeout"
