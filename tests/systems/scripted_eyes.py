"""A stand-in for everything that sees, wired to ArmMotion: frames, masks and pushes by a script."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import VectorLogSink

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import NO_MASK, NO_PAIR, Frame, FramePair
from riseg_drake.pushing.arm_path import PushPath
from riseg_drake.pushing.decision import UNDECIDED, Decision, Ending
from riseg_drake.pushing.push import Push
from riseg_drake.pushing.time_law import SpeedLimits, minimum_jerk, rest_to_rest
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.systems.arm_motion import ArmMotion

Q_OBSERVE = np.array([0.0, -0.54, 0.0, -2.55, 0.0, 2.01, 0.0])
CAMERA = Intrinsics(4, 4, 2.0, 2.0, 1.5, 1.5)
SECONDS = 1 / 15
NOTHING_LEFT = Decision(ending=Ending.NOTHING_LEFT, unsettled_area=0.0)


def push_to(q_there, start_offset=0.0, at=0.0, limits=None):
    """A push whose path goes to q_there and back, in no time to speak of."""
    q_from, limits = Q_OBSERVE + start_offset, limits or SpeedLimits()
    there = rest_to_rest(np.array([q_from, q_there]), minimum_jerk, limits, PANDA_LIMITS)
    back = rest_to_rest(np.array([q_there, q_from]), minimum_jerk, limits, PANDA_LIMITS)
    middle = there.end_time()
    back.shiftRight(middle)
    there.ConcatenateInTime(back)
    return Push(
        p_WE=np.array([0.48 + at, 0.0, 0.008]),
        tip_height=0.008,
        direction_W=np.array([1.0, 0.0]),
        p_WB=np.array([0.5 + at, 0.0, 0.02]),
        length=0.03,
        d_push=0.02,
        center_W=np.array([0.52, 0.0]),
        cluster_W=np.zeros((1, 2)),
        tallest=0.05,
        cost=0.0,
        path=PushPath(there, push_start=middle / 2, push_end=middle),
    )


def show_still(motion: ArmMotion, context: Context, time: float) -> None:
    """One frame, taken at a time, s, in which nothing has an id, and the push that was found in it."""
    frame = Frame(1, time, CAMERA, None, np.ones((4, 4), np.float32), np.eye(4), np.zeros((4, 4), bool))
    for name, value in {
        "decision": Decision(push_to(THERE), unsettled_area=0.01),
        "pair": FramePair(frame, frame),
        "mask": np.zeros((4, 4), np.uint16),
    }.items():
        motion.GetInputPort(name).FixValue(context, Value[object](value))


@dataclass
class Script:
    """What the stand-in answers: a push for each interaction, then a null; and what the mask shows."""

    pushes: list
    null: Decision = NOTHING_LEFT
    ids_after: list = field(default_factory=lambda: [0] * 9)
    pixels_after: list = field(default_factory=lambda: [16] * 9)
    """How many pixels of the 16 have the id."""
    depth: float = 0.5
    """Of everything, m."""
    vain_looks: int = 0
    """In so many frames before each push none is found."""
    undecided: tuple[float, float] = (0.0, 0.0)
    """From when to when the scene is not at rest, s."""
    asked: list = field(default_factory=list)


class Eyes(LeafSystem):
    """Camera, segmentation and planner in one: frames at 15 Hz, a scripted mask, scripted pushes."""

    def __init__(self, script):
        super().__init__()
        self.script = script
        looks: Counter[int] = Counter()
        step = self.DeclareAbstractInputPort("interaction_step", AbstractValue.Make(0))
        time = {self.time_ticket()}

        def frame(context):
            sequence = int(context.get_time() / SECONDS + 1e-6)
            color = np.zeros((4, 4, 3), np.uint8)
            depth = np.full((4, 4), script.depth, np.float32)
            return Frame(sequence, sequence * SECONDS, CAMERA, color, depth, np.eye(4), np.zeros((4, 4), bool))

        def pair(context, output):
            output.set_value(FramePair(frame(context), frame(context)))

        def mask(context, output):
            done = step.Eval(context)
            labels = np.zeros(16, np.uint16)
            labels[: script.pixels_after[done]] = script.ids_after[done]
            output.set_value(labels.reshape(4, 4))

        def decided(context, output):
            start, end = script.undecided
            output.set_value(not start <= context.get_time() < end)

        def decision(context, output):
            script.asked.append((context.get_time(), frame(context).time))
            done = step.Eval(context)
            looks[done] += 1
            found = done < len(script.pushes) and looks[done] > script.vain_looks
            output.set_value(Decision(script.pushes[done], unsettled_area=0.01) if found else script.null)

        for name, model, calc in (
            ("pair", NO_PAIR, pair),
            ("mask", NO_MASK, mask),
            ("decided", True, decided),
            ("decision", UNDECIDED, decision),
        ):
            self.DeclareAbstractOutputPort(
                name, AbstractValue.Make(model).Clone, calc, time | {self.all_input_ports_ticket()}
            )


def wired(script, parameters=None, way_back=None):
    """ArmMotion with its stand-in, an arm that is where it is told to be, and a log of the commands."""
    builder = DiagramBuilder()
    motion = builder.AddSystem(ArmMotion(Q_OBSERVE, parameters, way_back=way_back))
    eyes = builder.AddSystem(Eyes(script))
    for name in ("pair", "mask", "decided", "decision"):
        builder.Connect(eyes.GetOutputPort(name), motion.GetInputPort(name))
    builder.Connect(motion.GetOutputPort("interaction_step"), eyes.GetInputPort("interaction_step"))
    builder.Connect(motion.GetOutputPort("position"), motion.GetInputPort("position_measured"))
    log = builder.AddSystem(VectorLogSink(7, 0.002))
    builder.Connect(motion.GetOutputPort("position"), log.get_input_port())
    return builder.Build(), motion, log


def run(script, until, parameters=None, way_back=None):
    """Phases in their order, with the simulator's final context, ArmMotion and the log."""
    diagram, motion, log = wired(script, parameters, way_back)
    simulator = Simulator(diagram)
    context = motion.GetMyContextFromRoot(simulator.get_context())
    phases = []

    def watch(root):
        phase = motion.GetOutputPort("phase").Eval(context)
        if not phases or phases[-1] is not phase:
            phases.append(phase)

    simulator.set_monitor(watch)
    simulator.AdvanceTo(until)
    return phases, motion, context, log.FindLog(simulator.get_context())


THERE = Q_OBSERVE + np.array([0.3, 0.2, 0.0, 0.3, 0.0, 0.0, 0.5])
