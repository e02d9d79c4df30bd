"""What is counted between two steps, with a stand-in for the diagram."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, ZeroOrderHold

from riseg_drake.app.run.interactions import BLIND, Progress, Truth, _Book, interactions
from riseg_drake.app.work_state import RunStoppedError
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.decision import UNDECIDED
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.segmentation.remembered_pair import PassedOver
from riseg_drake.segmentation.segmentation import nothing_segmented
from riseg_drake.stations.object_models import SceneError
from riseg_drake.systems.stage_clock import StageClock

SIZE = (8, 40)
CAMERA = Intrinsics(SIZE[1], SIZE[0], 40.0, 40.0, 19.5, 3.5)


class Scene:
    """One thing, 10 columns wide, that is moved along x; the mask shows `found` of its columns."""

    def __init__(self):
        self.x, self.found, self.drawn = 0.5, 10, []

    def mask(self, _):
        mask = np.zeros(SIZE, np.uint16)
        mask[:, 5 : 5 + self.found] = 3
        return mask

    def segmentation(self, _):
        return replace(nothing_segmented(SIZE), label=self.mask(None))

    def read(self, port, _):
        return PassedOver() if port == "passed_over" else NO_PUSH

    def truth(self, frame, _):
        def draw():
            self.drawn.append(frame.sequence)
            labels = np.zeros(SIZE, np.uint16)
            labels[:, 5:15] = 1
            return labels

        X_WB = np.eye(4)
        X_WB[0, 3] = self.x
        return Truth(draw, {"toy": X_WB}, {1: "toy"})


def frame(sequence):
    color, depth = np.zeros((*SIZE, 3), np.uint8), np.full(SIZE, 0.5, np.float32)
    return Frame(sequence, sequence / 15, CAMERA, color, depth, np.eye(4), np.zeros(SIZE, bool))


def test_moved_objects_are_scored_in_every_frame_from_one_centimetre_on_and_drawn_in_no_other():
    scene = Scene()
    book = _Book(scene, None, StageClock(), scene.truth)
    book.count(frame(0), is_at_rest=True)
    assert book.close(0).in_motion is None
    scene.drawn.clear()
    # The arm approaches, pushes by 2 cm, goes back, and looks again.
    for sequence, (x, found) in enumerate(
        [(0.500, 10), (0.505, 10), (0.5099, 10), (0.5101, 5), (0.52, 10), (0.52, 0)], start=1
    ):
        scene.x, scene.found = x, found
        book.count(frame(sequence), is_at_rest=False)
    assert scene.drawn == [4, 5, 6]
    scene.found = 8
    book.count(frame(7), is_at_rest=True)
    step = book.close(1)
    assert step.moved == {frame(sequence).time: [1] for sequence in (4, 5, 6)}
    figures = step.in_motion
    assert figures.frames == 3
    assert figures.overlap_f == pytest.approx((2 / 3 + 1 + 0) / 3)  # P = 1, R = 1 / 2; all; nothing
    assert figures.at_rest_f == pytest.approx(2 * 0.8 / 1.8)
    # The next interaction counts from where things stand now.
    book.count(frame(8), is_at_rest=False)
    book.count(frame(9), is_at_rest=True)
    step = book.close(2)
    assert step.in_motion is None
    assert step.moved == {}


def test_where_nobody_knows_the_truth_nothing_is_scored():
    scene = Scene()
    book = _Book(scene, None, StageClock(), lambda frame, context: None)
    for step in range(2):
        book.count(frame(2 * step), is_at_rest=False)
        book.count(frame(2 * step + 1), is_at_rest=True)
        assert book.close(step).in_motion is None


class Idle(Scene):
    """A diagram in which nothing happens, and when its end was shown."""

    stages = ()

    def __init__(self):
        super().__init__()
        builder = DiagramBuilder()
        builder.AddSystem(ConstantVectorSource([0.0]))
        self.diagram, self.ends = builder.Build(), []

    def segmentation(self, _):
        return nothing_segmented(SIZE)

    def phase(self, _):
        return ArmPhase.OBSERVE

    def last_decision(self, _):
        return UNDECIDED

    def show_end(self, context):
        self.ends.append(context.get_time())


def test_a_run_that_is_over_shows_its_end_once():
    idle, progress = Idle(), Progress()
    assert list(interactions(idle, StageClock(), progress, 0.5, truth=lambda *_: None)) == []
    assert progress.end.startswith("0.5 s were simulated")
    assert idle.ends == [0.5]


class Blind(Idle):
    """From 1 s on no picture shows the table, twice a second; at `seen` one does."""

    def __init__(self, seen):
        super().__init__()
        builder = DiagramBuilder()
        nothing, hold = builder.AddSystem(ConstantVectorSource([0.0])), builder.AddSystem(ZeroOrderHold(0.5, 1))
        builder.Connect(nothing.get_output_port(), hold.get_input_port())
        self.diagram, self.seen = builder.Build(), seen

    def read(self, port, context):
        time = context.get_time()
        if port != "passed_over" or time < 1.0 or time == self.seen:
            return super().read(port, context)
        return PassedOver(time, "no plane: 0 pixels with depth")


@pytest.mark.parametrize(("seen", "end"), [(-1.0, 1.0 + BLIND + 0.5), (20.0, 20.5 + BLIND + 0.5)])
def test_a_run_ends_when_for_half_a_minute_no_picture_has_shown_the_table(seen, end):
    blind, progress = Blind(seen), Progress()
    with pytest.raises(
        RunStoppedError, match="for 30 s no picture has shown a table; the last: no plane: 0 pix"
    ):
        list(interactions(blind, StageClock(), progress, 100.0, truth=lambda *_: None))
    blind, progress = Blind(seen), Progress()
    before = end - 0.5
    assert list(interactions(blind, StageClock(), progress, before, truth=lambda *_: None)) == []
    assert progress.end.startswith(f"{before:g} s were simulated")


def first_look(labels, names):
    book = _Book(Scene(), None, StageClock(), lambda *_: Truth(lambda: labels, {}, names))
    book.count(frame(0), is_at_rest=True)
    return book


def test_a_first_look_that_shows_none_of_the_objects_ends_it_and_one_that_shows_a_pixel_does_not():
    names, labels = {1: "toy", 2: "can"}, np.zeros(SIZE, np.uint16)
    with pytest.raises(SceneError, match=r"^the camera sees none of the objects \(toy, can\)"):
        first_look(labels, names).check_sight()
    labels[0, 0] = 2
    first_look(labels, names).check_sight()


def test_a_look_at_a_table_with_nothing_on_it_goes_on():
    first_look(np.zeros(SIZE, np.uint16), {}).check_sight()
