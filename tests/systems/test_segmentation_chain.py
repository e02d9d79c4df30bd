"""All systems of Alg. 2 wired: every stage works once a frame, whoever reads and however often."""

from collections import Counter

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus, LeafSystem
from pydrake.systems.sensors import ImageDepth32F, ImageRgba8U

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.segmentation_block import add_stages
from riseg_drake.systems import (
    bfif_grouper,
    camera_motion,
    expected_flow,
    mask_propagator,
    objects_above_table,
    optical_flow,
)
from riseg_drake.systems.frame_view import FrameView
from tests.segmentation.drawn_scene import CAMERA, looking_down
from tests.segmentation.watched import Watcher

PERIOD = 1 / 15
JUST_BEFORE = 0.01
"""Of the next tick, s."""


class Film(LeafSystem):
    """A station that shows drawn frames, one a period; its arm trembles all the time.

    The camera's place along x is joint 1, the number of the frame joint 2; the tremble is joint 7's.
    """

    def __init__(self, frames, ticks: int) -> None:
        """Each frame stays for some ticks of the diagram's."""
        super().__init__()
        self._frames, self._ticks = frames, ticks
        self._shown = self.DeclareDiscreteState([0.0])
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, PERIOD, self._tick)
        for name, model, calc in (
            ("color_image", Value(ImageRgba8U()), self._calc_color),
            ("depth_image", Value(ImageDepth32F()), self._calc_depth),
        ):
            self.DeclareAbstractOutputPort(name, model.Clone, calc, {self.all_state_ticket()})
        self.DeclareVectorOutputPort("image_time", 1, self._calc_time, {self.all_state_ticket()})
        self.DeclareVectorOutputPort("position", 7, self._calc_position)

    def _number(self, context) -> int:
        return int(context.get_discrete_state(self._shown)[0]) // self._ticks

    def _tick(self, context, state) -> None:
        state.get_mutable_vector(self._shown)[0] += 1

    def _calc_color(self, context, output) -> None:
        image = ImageRgba8U(CAMERA.width, CAMERA.height)
        image.mutable_data[..., :3] = self._frames[self._number(context)].color
        output.set_value(image)

    def _calc_depth(self, context, output) -> None:
        image = ImageDepth32F(CAMERA.width, CAMERA.height)
        image.mutable_data[..., 0] = self._frames[self._number(context)].depth
        output.set_value(image)

    def _calc_time(self, context, output) -> None:
        output[0] = self._number(context) * self._ticks * PERIOD

    def _calc_position(self, context, output) -> None:
        number = self._number(context)
        output.SetFromVector([0.001 * number, number, 0, 0, 0, 0, np.sin(100 * context.get_time())])


class Reader(LeafSystem):
    """Reads every output of every stage, 500 times a second."""

    def __init__(self, ports) -> None:
        super().__init__()
        self.reads = 0
        self._inputs = []
        for k, port in enumerate(ports):
            self._inputs.append(self._declare(f"u{k}", port))
        self.DeclarePeriodicPublishEvent(0.002, 0.0005, self._read)

    def _declare(self, name, port):
        if port.get_data_type().name == "kVectorValued":
            return self.DeclareVectorInputPort(name, port.size())
        return self.DeclareAbstractInputPort(name, port.Allocate())

    def _read(self, context) -> EventStatus:
        self.reads += 1
        for read in self._inputs:
            read.Eval(context)
        return EventStatus.Succeeded()


@pytest.fixture
def counts(monkeypatch) -> Counter:
    """How often the work of each stage was done."""
    made: Counter = Counter()

    def count(module, name) -> None:
        work = getattr(module, name)

        def counted(*arguments):
            made[name] += 1
            return work(*arguments)

        monkeypatch.setattr(module, name, counted)

    count(objects_above_table, "objects_above_table")
    count(optical_flow, "flow_around")
    count(camera_motion, "settled_pair")
    count(expected_flow, "expected_flow")
    count(bfif_grouper, "group_body_frames")
    count(mask_propagator, "segment")
    return made


class Chain:
    """The film, Alg. 2 wired as in the product, and the reader."""

    def __init__(self, frames, counts: Counter, ticks: int = 1) -> None:
        builder = DiagramBuilder()
        film = builder.AddSystem(Film(frames, ticks))

        def forward(q: np.ndarray) -> np.ndarray:
            counts["forward_kinematics"] += 1
            return looking_down(q[0])

        nobody = np.zeros(CAMERA.shape, bool)
        view = FrameView(CAMERA, forward, lambda q: nobody)
        block = add_stages(builder, Scenario(), view, PERIOD, seed=0)
        for name, port in block.inputs.items():
            builder.Connect(film.GetOutputPort(name), port)
        self.propagator = block.outputs["mask"].get_system()
        ports = [
            stage.get_output_port(k)
            for stage in block.stages
            if stage is not view  # which follows the arm's tremble, read or not, as does what it feeds
            and stage.get_name() != "FrameReducer"
            and not stage.get_name().endswith("ObjectsAboveTable")  # the whole one is for who asks
            for k in range(stage.num_output_ports())
        ]
        self.reader = builder.AddSystem(Reader(ports))
        for k, port in enumerate(ports):
            builder.Connect(port, self.reader.get_input_port(k))
        self.simulator = Simulator(builder.Build())

    def mask(self) -> np.ndarray:
        context = self.propagator.GetMyContextFromRoot(self.simulator.get_context())
        return self.propagator.GetOutputPort("mask").Eval(context)


STAGES = {
    "forward_kinematics",
    "objects_above_table",
    "expected_flow",
    "flow_around",
    "settled_pair",
    "group_body_frames",
    "segment",
}


def test_every_stage_works_once_a_frame_though_someone_reads_at_500_hz(drawn_frames, counts) -> None:
    chain = Chain(drawn_frames, counts)
    for number in range(1, len(drawn_frames) + 1):
        chain.simulator.AdvanceTo(number * PERIOD - JUST_BEFORE)
        assert dict(counts) == dict.fromkeys(STAGES, number)
    assert chain.reader.reads > 200


def test_stages_do_not_work_again_where_the_camera_is_slower_than_the_diagram(drawn_frames, counts) -> None:
    ticks, frames = 3, drawn_frames[:5]
    chain = Chain(frames, counts, ticks)
    for number in range(1, len(frames) + 1):
        chain.simulator.AdvanceTo(number * ticks * PERIOD - JUST_BEFORE)
        for stage in ("flow_around", "settled_pair", "expected_flow", "group_body_frames", "segment"):
            assert counts[stage] == number, stage


def test_the_wired_systems_give_the_masks_that_the_functions_give(drawn_frames, counts) -> None:
    chain, watcher = Chain(drawn_frames, counts), Watcher()
    for number, frame in enumerate(drawn_frames):
        chain.simulator.AdvanceTo((number + 1) * PERIOD - JUST_BEFORE)
        np.testing.assert_array_equal(chain.mask(), watcher.take(frame).mask)
    assert chain.mask().any()
