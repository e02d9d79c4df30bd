"""MaskRefiner: no frame waits for the model, and each interaction's mask is refined once."""

import os
import sys
import threading

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from riseg_drake.geometry.rgbd import NO_MASK, NO_PAIR, FramePair
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.systems.mask_refiner import NO_REFINED_MASK, MaskRefiner
from tests.systems.ports import port_names

PERIOD, OFFSET = 0.1, 0.002
LONG = 10.0
"""s; what waits for the worker in these tests waits for microseconds, unless something is broken."""


class SlowModel:
    """Adds 100 to every id, but not before it is told that it may."""

    def __init__(self) -> None:
        self.may_end = threading.Event()
        self.has_begun = threading.Event()
        self.frames: list[int] = []

    def __call__(self, frame, mask):
        self.frames.append(frame.sequence)
        self.has_begun.set()
        assert self.may_end.wait(LONG)
        return np.where(mask > 0, mask + 100, 0).astype(np.uint16)


class Alone:
    """A refiner whose inputs are fixed by hand, simulated."""

    def __init__(self, refine, frames) -> None:
        self.frames = frames
        self.system = MaskRefiner(refine, PERIOD, OFFSET)
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        self.ticks = 0
        self.show(pair=NO_PAIR, mask=NO_MASK, phase=ArmPhase.OBSERVE)

    def show(self, **inputs) -> None:
        for name, value in inputs.items():
            self.system.GetInputPort(name).FixValue(self.context, Value[object](value))

    def tick(self, number: int, phase: ArmPhase, **others):
        """One camera frame, whose mask has the frame's number plus 1 in it; the output after it."""
        frame = self.frames[number]
        mask = np.zeros(frame.depth.shape, np.uint16)
        mask[:5] = number + 1
        self.show(pair=FramePair(frame, frame), mask=mask, phase=phase, **others)
        self.simulator.AdvanceTo(self.ticks * PERIOD + 2 * OFFSET)
        self.ticks += 1
        return self.refined()

    def refined(self):
        return self.system.GetOutputPort("refined").Eval(self.context)

    def finish(self):
        return self.system.finish(self.context)


@pytest.fixture
def model():
    slow = SlowModel()
    yield slow
    slow.may_end.set()  # a worker that waits for ever would keep pytest from ending


def test_ports_have_the_names_of_the_contract():
    inputs, outputs = port_names(MaskRefiner(lambda frame, mask: mask, PERIOD, OFFSET))
    assert inputs == ["pair", "mask", "phase", "demand"]
    assert outputs == ["refined"]


def test_frames_go_on_while_the_model_works_and_its_answer_comes_later(drawn_frames, model):
    alone = Alone(model, drawn_frames)
    alone.tick(0, ArmPhase.OBSERVE)
    alone.tick(1, ArmPhase.OBSERVE)
    alone.tick(2, ArmPhase.APPROACH)
    assert model.has_begun.wait(LONG)
    # The model does not end before we say so: an update that waited for it would never return.
    for number in (3, 4, 5, 6, 7):
        assert alone.tick(number, ArmPhase.PUSH) is NO_REFINED_MASK
    assert alone.ticks == 8
    model.may_end.set()
    (coming,) = alone.finish()
    refined = alone.tick(7, ArmPhase.PUSH)
    assert refined is coming
    assert refined.time == drawn_frames[1].time
    assert set(np.unique(refined.mask)) == {0, 102}


def test_the_last_mask_at_rest_is_refined_once_for_each_interaction(drawn_frames, model):
    model.may_end.set()
    alone = Alone(model, drawn_frames)
    for number, phase in enumerate(
        (
            ArmPhase.OBSERVE,
            ArmPhase.OBSERVE,
            ArmPhase.PUSH,
            ArmPhase.RETREAT,
            ArmPhase.OBSERVE,
            ArmPhase.APPROACH,
            ArmPhase.OBSERVE,
            ArmPhase.DONE,
        )
    ):
        alone.tick(number, phase)
    alone.finish()
    assert model.frames == [1, 4, 6]


def test_every_answer_is_shown_though_several_end_at_once(drawn_frames, model):
    alone = Alone(model, drawn_frames)
    for number in (0, 2, 4):
        alone.tick(number, ArmPhase.OBSERVE)
        alone.tick(number + 1, ArmPhase.PUSH)
    model.may_end.set()
    alone.finish()
    shown = [alone.tick(6, ArmPhase.PUSH).time for _ in range(4)]
    assert shown == [drawn_frames[k].time for k in (0, 2, 4, 4)]


def test_one_is_refined_after_the_other(drawn_frames, model):
    threads = set()

    def noted(frame, mask):
        threads.add(threading.get_ident())
        return model(frame, mask)

    alone = Alone(noted, drawn_frames)
    for number in (0, 2, 4):
        alone.tick(number, ArmPhase.OBSERVE)
        alone.tick(number + 1, ArmPhase.PUSH)
    model.may_end.set()
    alone.finish()
    assert len(threads) == 1
    assert model.frames == [0, 2, 4]


def test_on_demand_the_present_mask_is_refined_at_once(drawn_frames, model):
    model.may_end.set()
    alone = Alone(model, drawn_frames)
    alone.tick(0, ArmPhase.PUSH, demand=0)
    alone.tick(1, ArmPhase.PUSH, demand=0)
    assert alone.finish() == []
    alone.tick(2, ArmPhase.PUSH, demand=1)
    alone.tick(3, ArmPhase.PUSH, demand=1)
    alone.finish()
    assert model.frames == [2]


def test_at_the_end_the_last_mask_at_rest_is_not_forgotten(drawn_frames, model):
    model.may_end.set()
    alone = Alone(model, drawn_frames)
    alone.tick(3, ArmPhase.OBSERVE)
    (refined,) = alone.finish()
    assert refined.time == drawn_frames[3].time


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux gives each thread its own niceness")
def test_the_worker_stands_back_and_the_frames_do_not(drawn_frames):
    nicenesses = []

    def note(frame, mask):
        nicenesses.append(os.getpriority(os.PRIO_PROCESS, threading.get_native_id()))
        return mask

    before = os.getpriority(os.PRIO_PROCESS, threading.get_native_id())
    alone = Alone(note, drawn_frames)
    alone.tick(0, ArmPhase.OBSERVE)
    alone.finish()
    assert nicenesses == [min(before + 10, 19)]
    assert os.getpriority(os.PRIO_PROCESS, threading.get_native_id()) == before


def test_without_a_frame_nothing_happens(model):
    alone = Alone(model, [])
    alone.simulator.AdvanceTo(3 * PERIOD)
    assert alone.refined() is NO_REFINED_MASK
    assert alone.finish() == []


def test_what_goes_wrong_in_the_worker_is_not_lost(drawn_frames):
    def broken(frame, mask):
        raise ValueError("out of memory")

    alone = Alone(broken, drawn_frames)
    alone.tick(0, ArmPhase.OBSERVE)
    alone.tick(1, ArmPhase.PUSH)
    with pytest.raises(ValueError, match="out of memory"):
        alone.finish()
    with pytest.raises(ValueError, match="out of memory"):
        alone.tick(2, ArmPhase.PUSH)


def test_before_the_first_refined_mask_there_is_one_of_no_pixel_from_before_all_time():
    assert NO_REFINED_MASK.time == -np.inf
    assert NO_REFINED_MASK.mask is NO_MASK
