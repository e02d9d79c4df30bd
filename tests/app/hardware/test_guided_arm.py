"""Out of a push by a person's hand, and on at the operator's word: diagram, watch and commands on one clock."""

from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from riseg_drake.app.hardware import arm_travel, arm_watch
from riseg_drake.app.hardware.arm_travel import TravelError, WayBack, straight_motion, travel
from riseg_drake.app.hardware.arm_watch import ArmWatch
from riseg_drake.app.run.interactions import Progress
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.time_law import SpeedLimits
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.stations.hardware import Targets
from riseg_drake.systems.arm_motion import ArmMotion
from tests.robot.lab import PERIOD, Lab
from tests.systems.scripted_eyes import Q_OBSERVE, THERE, Eyes, Script, push_to


class Room:
    """All of `riseg hardware` but camera, segmentation and processes; the operator waits until `says`."""

    driver_says = ""

    def __init__(self, monkeypatch, mode):
        self.lab = Lab(mode, noise=1e-4, q=Q_OBSERVE)
        self.words, self.told, self.says = 0, [], None
        self.limits = SpeedLimits(0.28, 0.24, 0.1)
        self.way_back = WayBack(PandaKinematics(), Q_OBSERVE, self.limits, self)
        monkeypatch.setattr(arm_watch.time, "monotonic", lambda: self.lab.now)
        builder = DiagramBuilder()
        script = Script([push_to(THERE, limits=self.limits), push_to(THERE, at=0.1, limits=self.limits)])
        self.motion = builder.AddSystem(ArmMotion(Q_OBSERVE, None, None, self.done_until, self.way_back.take))
        eyes = builder.AddSystem(Eyes(script))
        for name in ("pair", "mask", "decision"):
            builder.Connect(eyes.GetOutputPort(name), self.motion.GetInputPort(name))
        builder.Connect(self.motion.GetOutputPort("interaction_step"), eyes.GetInputPort("interaction_step"))
        self.measured = builder.AddSystem(ConstantVectorSource(Q_OBSERVE))
        builder.Connect(self.measured.get_output_port(), self.motion.GetInputPort("position_measured"))
        targets = builder.AddSystem(Targets(self))
        builder.Connect(self.motion.GetOutputPort("position"), targets.get_input_port())
        self.simulator = Simulator(builder.Build())
        self.root = self.simulator.get_mutable_context()
        self.root.SetTime(self.lab.now)
        self.progress = Progress()
        self.watch = ArmWatch(self, self, self, self, self.progress, self.way_back, off_path=0.02)
        self.simulator.Initialize()

    def run(self, seconds):
        for _ in range(round(seconds / PERIOD)):
            self.simulator.AdvanceTo(self.lab.now)
            source = self.measured.get_mutable_source_value(
                self.measured.GetMyMutableContextFromRoot(self.root)
            )
            source.SetFromVector(self.lab.status.position)
            self.watch(self.root)
            self.lab.step()

    def until(self, condition, most=30.0):
        for _ in range(round(most / PERIOD)):
            if condition():
                return
            self.run(PERIOD)
        raise AssertionError(f"never; {self.told}")

    def see(self, name):
        return self.motion.GetOutputPort(name).Eval(self.motion.GetMyContextFromRoot(self.root))

    # the diagram
    def read(self, name, _):
        return self.see(name)

    def phase(self, _):
        return self.see("phase")

    # the process that sends commands
    def send_target(self, time, position):
        self.lab.stream.add_target(time, np.array(position))

    def done_until(self):
        return self.lab.stream.done_until

    def expect_contact(self, start, end):
        self.lab.stream.expect_contact(start, end)

    def release(self, anew=False):
        self.words += 1
        if anew:
            self.lab.stream.abandon_path()
        self.lab.stream.release()

    def begin_path(self):
        self.lab.stream.begin_path()

    @property
    def report(self):
        stream = self.lab.stream
        return SimpleNamespace(
            state=stream.state,
            refused="",
            words=stream.words,
            off_path=stream.off_path,
            status=self.lab.status,
        )

    # the operator
    def released(self, stop):
        if not self.told or self.told[-1] != stop:
            self.told.append(stop)
        said, self.says = self.says, None
        return said

    def tell(self, text):
        self.told.append(text)


@pytest.fixture
def room(monkeypatch, mode):
    room = Room(monkeypatch, mode)
    yield room
    del room.lab  # the simulator keeps the room, and that would keep what is not Python's


@pytest.mark.parametrize(
    ("mode", "phase"),
    [
        ("velocity", ArmPhase.APPROACH),
        pytest.param("position", ArmPhase.RETREAT, marks=pytest.mark.renders),
        pytest.param("velocity", ArmPhase.RETREAT, marks=pytest.mark.renders),
        pytest.param("position", ArmPhase.APPROACH, marks=pytest.mark.renders),
    ],
)
def test_an_arm_that_was_led_away_in_a_push_comes_back_at_the_operators_word_and_pushes_on(room, phase):
    room.until(lambda: room.see("phase") is phase)
    room.run(1.0)  # commands are 0.6 s late
    room.lab.die()
    room.run(1.0)
    room.lab.guide(0.3 * np.array([1, -0.5, 0, 0.5, 0, 0, 1]))
    room.run(1.0)
    room.lab.start_anew()
    room.lab.forget()
    room.run(5.0)  # the operator is in no hurry
    assert np.max(room.lab.speeds) <= 0.01
    assert not room.lab.sent()
    here = room.lab.q
    room.says = True
    room.run(0.2)
    assert np.abs(room.lab.q - here).max() < 1e-3
    assert any("off its path" in told for told in room.told)
    room.until(lambda: np.abs(room.lab.q - Q_OBSERVE).max() < 2e-3)
    assert room.see("interaction_step") <= 1
    room.until(lambda: room.see("interaction_step") == 2, most=40)
    assert (np.array(room.lab.speeds) <= 0.35 * room.lab.robot.velocity).all()
    assert room.watch.pauses <= 1
    assert not room.progress.end


class FirstWay:
    """What `travel` deals with, in one; the clock turns where it sleeps."""

    driver_says = ""

    def __init__(self, monkeypatch, mode):
        self.lab = Lab(mode, q=Q_OBSERVE - 0.2)
        self.words, self.told, self.deeds = 0, [], []
        monkeypatch.setattr(arm_travel.time, "monotonic", lambda: self.lab.now)
        monkeypatch.setattr(arm_travel.time, "sleep", self.lab.run)
        self.clock = lambda: self.lab.now

    send_target = Room.send_target
    release, begin_path = Room.release, Room.begin_path

    @property
    def status(self):
        return self.lab.status

    @property
    def report(self):
        stream = self.lab.stream
        return SimpleNamespace(
            state=stream.state,
            words=stream.words,
            status=self.lab.status,
            behind=stream.behind,
            at_rest=stream.at_rest,
        )

    def tell(self, text):
        self.told.append(text)

    def released(self, stop):
        """A second after every stop the next of the deeds is done, which says whether to go on."""
        self.told.append(stop)
        self.lab.run(1.0)
        return self.deeds.pop(0)()


@pytest.fixture
def first_way(monkeypatch, mode):
    return FirstWay(monkeypatch, mode)


def plan_to_observe(q_from):
    return straight_motion(PandaKinematics(), q_from, Q_OBSERVE, SpeedLimits(0.28, 0.24, 0.1))


@pytest.mark.parametrize("mode", ["velocity", "position"])
def test_on_its_very_first_way_too_a_stopped_arm_goes_on_at_the_operators_word_from_where_it_is(first_way):
    lab = first_way.lab
    looks = iter(range(10**6))

    def look():
        now = next(looks)
        if now == 50:
            lab.die()
        elif now == 100:
            lab.guide(0.1)
            lab.start_anew()

    def forget():
        assert not lab.stream.state.may_move
        lab.forget()
        return True

    first_way.deeds = [lambda: None, forget]
    travel(plan_to_observe, first_way, first_way, first_way, look)
    assert np.abs(lab.q - Q_OBSERVE).max() < 2e-3
    assert [line.split(":")[0] for line in first_way.told] == ["paused", *2 * ["the arm is stopped"]]
    assert lab.speeds[0].max() < 1e-2
    assert (np.array(lab.speeds) <= 0.35 * lab.robot.velocity).all()


@pytest.mark.parametrize("mode", ["velocity"])
def test_where_the_operator_does_not_want_it_the_first_way_ends_there_with_the_reason(first_way):
    first_way.deeds = [lambda: False]
    first_way.driver_says = "the robot takes no commands: joint_reflex"
    looks = iter(range(10**6))
    with pytest.raises(TravelError, match=r"pushes against the arm .*; its driver says: .*: joint_reflex"):
        travel(
            plan_to_observe,
            first_way,
            first_way,
            first_way,
            lambda: first_way.lab.push_against(60.0) if next(looks) == 50 else None,
        )
