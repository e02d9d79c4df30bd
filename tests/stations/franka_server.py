"""franka-sim (Apache-2.0) as a robot that is stepped with its client; run in an environment that has it.

Each cycle waits for the client's answer to the one before, however long that takes, so that nothing is judged
by wall time: the robot's clock goes by what was answered. Words on standard input make it fail; what it saw is
written to the file of the first argument when it ends: one row a cycle, robot_mode, q_d [7], q [7].

franka_server.py FILE.npy ADDRESS q1,...,q7 [paced]     from where; `paced`: no faster than real time
"""

import os
import struct
import sys
import tempfile
import threading
import time
import types

os.environ.pop("DISPLAY", None)

LINKS = (  # where joint i sits on the link before: x, y, z, quaternion w, x; kg; by the published DH parameters
    ((0, 0, 0.333), (1, 0), 3.0),
    ((0, 0, 0), (1, -1), 3.0),
    ((0, -0.316, 0), (1, 1), 2.5),
    ((0.0825, 0, 0), (1, 1), 2.5),
    ((-0.0825, 0.384, 0), (1, -1), 2.5),
    ((0, 0, 0), (1, 1), 1.5),
    ((0.088, 0, 0), (1, 1), 0.7),
)


def arm() -> str:
    """An FR3 of spheres, with its joints in the right places."""
    inner = (
        '<body name="fr3_link8" pos="0 0 0.107">'
        '<inertial mass="0.3" pos="0 0 0" diaginertia=".001 .001 .001"/></body>'
    )
    for index in range(7, 0, -1):
        (x, y, z), (w, turn), mass = LINKS[index - 1]
        inner = (
            f'<body name="fr3_link{index}" pos="{x} {y} {z}" quat="{w} {turn} 0 0">'
            f'<inertial mass="{mass}" pos="0 0 0" diaginertia=".02 .02 .02"/>'
            f'<joint name="fr3_joint{index}" axis="0 0 1" damping="0.1" armature="0.6"/>'
            f'<geom type="sphere" size="0.02" contype="0" conaffinity="0"/>{inner}</body>'
        )
    return (
        '<mujoco><compiler angle="radian"/><worldbody><body name="fr3_link0">'
        f'<geom type="sphere" size="0.02" contype="0" conaffinity="0"/>{inner}</body></worldbody></mujoco>'
    )


with tempfile.NamedTemporaryFile("w", suffix=".xml", delete=False) as model:
    model.write(arm())
os.environ["FR3_MJCF"] = model.name

import franka_sim.server.state_stream as state_stream  # noqa: E402
import numpy as np  # noqa: E402
from franka_sim import FrankaSimServer  # noqa: E402
from franka_sim.franka_protocol import Command, ConnectStatus, MessageHeader  # noqa: E402
from franka_sim.limits.checker import Violation  # noqa: E402
from franka_sim.motion_limits import JOINT_VELOCITY_VIOLATION_INDEX  # noqa: E402

USER_STOPPED, SPOKEN = 5, 10
PATIENCE = 0.8  # s; libfranka itself gives up after one
CATCHES_UP = 0.02  # s; of what it is late where it is paced


class SteppedServer(FrankaSimServer):
    """The robot; see above."""

    is_paced, due = False, 0.0
    lose, is_pressed, freezes = 0, False, False

    def _drain_gate(self, answer_deadline: float = 0.0) -> float:
        while self.freezes:
            time.sleep(0.1)
        give_up = time.monotonic() + PATIENCE
        if self.lose:
            self.lose -= 1
        elif not self.comm.active:
            time.sleep(0.001)
        else:
            while self.comm.awaiting_answer and time.monotonic() < give_up and self.connection_running:
                time.sleep(0.0)
        while self._commands_in_flight:
            time.sleep(0.0)
        state = self.robot_state.state
        rows.append([state["robot_mode"], *state["q_d"], *state["q"]])
        self.physics_sim.step()
        if self.is_paced:
            self.due = max(self.due, time.monotonic() - CATCHES_UP) + 0.001
            time.sleep(max(self.due - time.monotonic(), 0.0))
        if self.is_pressed:
            self.robot_state.state["robot_mode"] = USER_STOPPED
        return 0.0

    def send_response(self, client_socket, command, command_id, status, version) -> None:
        """Refuses the client's libfranka where the robot is of another version."""
        refused = ConnectStatus.kIncompatibleLibraryVersion if version != SPOKEN else status
        super().send_response(client_socket, command, command_id, refused, version)

    def reflex(self, index: int) -> None:
        """The robot stops by itself."""
        violation = Violation(index, "measured", "joint", 1.0, 0.0)
        self._latch_and_abort(violation, self.motion_limits.motion_id)

    def press(self) -> None:
        """Somebody presses the stop button."""
        self.is_pressed = True
        self._abort_with_error((), "user stop", self._motion_generation)
        self.robot_state.state["robot_mode"] = USER_STOPPED

    def release(self) -> None:
        """... and lets it go."""
        self.is_pressed = False
        self.robot_state.state["robot_mode"] = 1

    def handle_automatic_error_recovery_command(self, client_socket, header, payload) -> None:
        """A robot whose stop button is pressed does not recover."""
        if self.is_pressed:
            head = MessageHeader(Command.kAutomaticErrorRecovery, header.command_id, 16).to_bytes()
            self._send_tcp(client_socket, head + struct.pack("<B3x", 2))
        else:
            super().handle_automatic_error_recovery_command(client_socket, header, payload)


def obey(server: SteppedServer) -> None:
    """Do what standard input says, until it ends."""
    for line in sys.stdin:
        word, *rest = line.split()
        if word == "reflex":
            server.reflex(JOINT_VELOCITY_VIOLATION_INDEX)
        elif word == "press":
            server.press()
        elif word == "release":
            server.release()
        elif word == "lose":
            server.lose = int(rest[0])
        elif word == "freeze":
            server.freezes = True
        elif word == "thaw":
            server.freezes = False
        elif word == "version":
            server.library_version = int(rest[0])
        elif word == "save":
            np.save(file, np.array(rows))
        print("done", word, flush=True)
    np.save(file, np.array(rows))
    os._exit(0)


file, address, posture = sys.argv[1:4]
start = np.array([float(q) for q in posture.split(",")])
rows: list = []
server = SteppedServer(
    host=address,
    port=1337,
    enable_gripper=False,
    physics="mujoco",
    enforce_motion_limits=True,
    enforce_comm_constraints=True,
)
server.is_paced = "paced" in sys.argv
server.physics_sim.initialize_simulation()
server.physics_sim.data.qpos[server.physics_sim.arm_qpos_adr] = start
server.physics_sim.latest_joint_positions = start.copy()
server.physics_sim.step()
clock = types.SimpleNamespace(**{name: getattr(time, name) for name in ("time", "perf_counter", "monotonic")})
clock.sleep = lambda seconds: None
state_stream.time = clock
server._bind_listener()
threading.Thread(target=server.run_server, daemon=True).start()
print("ready", flush=True)
obey(server)
