"""FramePairMemory: which image goes with which theta, and with which reference."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.sensors import ImageDepth32F, ImageRgba8U

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.rgbd import NO_FRAME, NO_PAIR, FramePair
from riseg_drake.segmentation.above_table import NOTHING_ABOVE_TABLE, AboveTable
from riseg_drake.segmentation.camera_motion import CameraMotionParameters
from riseg_drake.segmentation.frame_pairs import FramePairParameters
from riseg_drake.segmentation.remembered_pair import PassedOver
from riseg_drake.segmentation.table_plane import NoPlaneError
from riseg_drake.systems import frame_pair
from riseg_drake.systems.frame_pair import FramePairMemory
from riseg_drake.systems.frame_view import FrameView
from tests.systems.ports import port_names

CAMERA = Intrinsics(6, 4, 5.0, 5.0, 2.5, 1.5)
PERIOD, OFFSET = 0.1, 0.001


class Station(LeafSystem):
    """At each tick a new image and a new theta, both with the frame's number written into them."""

    def __init__(self, repeat: int = 1) -> None:
        """`repeat` ticks in a row show the same image, with the same time."""
        super().__init__()
        self._repeat = repeat
        self._ticks = self.DeclareDiscreteState([-1.0])
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self._tick)
        for name, image, calc in (
            ("color_image", ImageRgba8U(), self._calc_color),
            ("depth_image", ImageDepth32F(), self._calc_depth),
        ):
            model = Value(image)
            self.DeclareAbstractOutputPort(name, model.Clone, calc, {self.all_state_ticket()})
        self.DeclareVectorOutputPort("image_time", 1, self._calc_time, {self.all_state_ticket()})
        self.DeclareVectorOutputPort("position", 7, self._calc_position, {self.all_state_ticket()})

    def number(self, context) -> int:
        """Of the newest frame; -1 before the first tick."""
        ticks = int(context.get_discrete_state(self._ticks)[0])
        return ticks // self._repeat if ticks >= 0 else -1

    def _tick(self, context, state) -> None:
        state.get_mutable_vector(self._ticks)[0] = context.get_discrete_state(self._ticks)[0] + 1

    def _calc_color(self, context, output) -> None:
        number = self.number(context)
        image = ImageRgba8U(6, 4) if number >= 0 else ImageRgba8U()
        image.mutable_data[...] = max(0, number)
        output.set_value(image)

    def _calc_depth(self, context, output) -> None:
        number = self.number(context)
        image = ImageDepth32F(6, 4) if number >= 0 else ImageDepth32F()
        image.mutable_data[...] = 1 + number
        output.set_value(image)

    def _calc_time(self, context, output) -> None:
        output[0] = max(0, self.number(context)) * self._repeat * PERIOD

    def _calc_position(self, context, output) -> None:
        output.SetFromVector(np.full(7, float(self.number(context))))


class AboveOfFrame(LeafSystem):
    """In place of ObjectsAboveTable: says of which frame it would have been, by the image's number."""

    def __init__(self, bare: Collection[int] = ()) -> None:
        """The images of the numbers in `bare` show no table."""
        super().__init__()
        self._bare = bare
        frame = self.DeclareAbstractInputPort("frame", AbstractValue.Make(NO_FRAME))
        self.DeclareAbstractOutputPort(
            "above_table",
            AbstractValue.Make(NOTHING_ABOVE_TABLE).Clone,
            lambda context, output: output.set_value(self._above(number_in(frame.Eval(context)))),
            {self.all_input_ports_ticket()},
        )

    def _above(self, number: int | None) -> AboveTable:
        if number in self._bare:
            raise NoPlaneError(f"no plane in {number}")
        return above_of(number)


def forward(q: np.ndarray) -> np.ndarray:
    X_WC = np.eye(4)
    X_WC[0, 3] = q[0] / 100
    return X_WC


def silhouette(q: np.ndarray) -> np.ndarray:
    mask = np.zeros(CAMERA.shape, bool)
    mask.flat[: int(q[0])] = True
    return mask


def number_in(frame) -> int | None:
    """The number written into the image."""
    return None if frame is NO_FRAME else int(frame.color[0, 0, 0])


def above_of(number: int | None) -> AboveTable:
    """Says of which frame it would have been."""
    return replace(NOTHING_ABOVE_TABLE, distance=-1.0 if number is None else float(number))


class Loop:
    """Station, FrameView and FramePairMemory, simulated."""

    def __init__(self, found: float = 0.0, repeat: int = 1, bare: Collection[int] = (), **parameters) -> None:
        builder = DiagramBuilder()
        self.station = builder.AddSystem(Station(repeat))
        view = builder.AddSystem(FrameView(CAMERA, forward, silhouette))
        above = builder.AddSystem(AboveOfFrame(bare))
        self.memory = builder.AddSystem(FramePairMemory(PERIOD, OFFSET, FramePairParameters(**parameters)))
        span = builder.AddSystem(ConstantVectorSource([found]))
        for name in ("color_image", "depth_image", "image_time", "position"):
            builder.Connect(self.station.GetOutputPort(name), view.GetInputPort(name))
        for target in (above, self.memory):
            builder.Connect(view.GetOutputPort("frame"), target.GetInputPort("frame"))
        builder.Connect(above.GetOutputPort("above_table"), self.memory.GetInputPort("above_table"))
        builder.Connect(span.get_output_port(), self.memory.GetInputPort("flow_span"))
        self.simulator = Simulator(builder.Build())
        self.context = self.memory.GetMyContextFromRoot(self.simulator.get_context())

    def at(self, time: float) -> FramePair:
        self.simulator.AdvanceTo(time)
        return self.read("pair")

    def read(self, port: str):
        return self.memory.GetOutputPort(port).Eval(self.context)


JUST_AFTER = OFFSET + 1e-4
"""After a tick, s: the memory has had its turn."""


def test_ports_have_the_names_of_the_contract() -> None:
    inputs, outputs = port_names(FramePairMemory(PERIOD, OFFSET))
    assert inputs == ["frame", "above_table", "flow_span", "settled_pair"]
    assert outputs == [
        "pair",
        "whole_pair",
        "whole_frame",
        "above_table_reference",
        "above_table",
        "pose_error",
        "passed_over",
        "pair_time",
    ]


def test_before_the_first_frame_there_is_nothing() -> None:
    loop = Loop()
    assert loop.at(OFFSET / 2) is NO_PAIR
    assert loop.read("whole_pair") is NO_PAIR
    assert loop.read("whole_frame") is NO_FRAME
    assert loop.read("above_table") is NOTHING_ABOVE_TABLE
    assert loop.read("above_table_reference") is NOTHING_ABOVE_TABLE
    assert loop.read("pair_time") == pytest.approx([0.0])


@pytest.mark.parametrize("kind", ["motion", "consecutive"])
@pytest.mark.parametrize("found", [0.0, 5.0, 50.0])
def test_image_theta_and_objmask_of_a_frame_belong_to_the_same_tick(kind: str, found: float) -> None:
    loop = Loop(found, kind=kind)
    for tick in range(8):
        pair = loop.at(tick * PERIOD + JUST_AFTER)
        for frame in (pair.reference, pair.current):
            number = number_in(frame)
            assert frame.X_WC[0, 3] == number / 100
            assert np.count_nonzero(frame.robot) == number
            assert frame.depth[0, 0] == 1 + number
            assert frame.time == pytest.approx(number * PERIOD)
            assert frame.sequence == number
        assert loop.read("above_table").distance == number_in(pair.current)
        assert loop.read("above_table_reference").distance == number_in(pair.reference)
        assert loop.read("pair_time") == pytest.approx([pair.current.time])


def test_the_frame_of_a_tick_is_there_right_after_that_tick() -> None:
    loop = Loop()
    for tick in range(5):
        assert number_in(loop.at(tick * PERIOD + JUST_AFTER).current) == tick
        assert number_in(loop.at((tick + 0.99) * PERIOD).current) == tick


def test_the_first_frame_is_paired_with_itself() -> None:
    pair = Loop().at(JUST_AFTER)
    assert pair.reference is pair.current


def test_consecutive_pairs_follow_each_other() -> None:
    loop = Loop(kind="consecutive")
    pairs = [loop.at(tick * PERIOD + JUST_AFTER) for tick in range(4)]
    assert [number_in(pair.reference) for pair in pairs] == [0, 0, 1, 2]


@pytest.mark.parametrize(("found", "references"), [(5.0, [0, 0, 0, 0]), (50.0, [0, 0, 1, 2])])
def test_the_flow_span_decides_whether_the_reference_stays(found: float, references: list[int]) -> None:
    far = {"camera_span_moving": 1e3, "camera_span_still": 1e3}
    loop = Loop(found, flow_span_share=20.0 / CAMERA.width, **far)
    pairs = [loop.at(tick * PERIOD + JUST_AFTER) for tick in range(4)]
    assert [number_in(pair.reference) for pair in pairs] == references


def test_an_image_that_repeats_is_no_new_frame() -> None:
    loop = Loop(repeat=3, kind="consecutive")
    pairs = [loop.at(tick * PERIOD + JUST_AFTER) for tick in range(9)]
    assert [pair.current.sequence for pair in pairs] == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    assert pairs[3] is pairs[5]
    assert [number_in(pair.reference) for pair in pairs] == [0, 0, 0, 0, 0, 0, 1, 1, 1]


def test_an_image_that_shows_no_table_is_passed_over_and_told_until_one_does() -> None:
    loop = Loop(bare={0, 2, 3}, kind="consecutive")
    numbers, told = [], []
    for tick in range(6):
        pair = loop.at(tick * PERIOD + JUST_AFTER)
        numbers.append(None if pair is NO_PAIR else (number_in(pair.reference), number_in(pair.current)))
        told.append(loop.read("passed_over"))
    assert numbers == [None, (1, 1), (1, 1), (1, 1), (1, 4), (4, 5)]
    nothing = PassedOver()
    out = [PassedOver(pytest.approx(number * PERIOD), f"no plane in {number}") for number in (0, 2, 3)]
    assert told == [out[0], nothing, out[1], out[2], nothing, nothing]


def test_an_unknown_kind_of_pairs_is_refused_with_the_choices() -> None:
    with pytest.raises(ValueError, match="motion or consecutive"):
        Loop(kind="keyframe").at(2 * PERIOD)


@pytest.mark.parametrize("wired", [True, False], ids=["", "settled_pair left open"])
@pytest.mark.parametrize("given", [True, False])
def test_the_function_is_handed_the_frame_what_flowed_what_was_left_and_the_parameters(
    monkeypatch, given: bool, wired: bool
) -> None:
    handed = []

    def with_frame(memory, frame, *others):
        handed.append(others)
        return replace(memory, pair=FramePair(frame, frame))

    monkeypatch.setattr(frame_pair, "with_frame", with_frame)
    parameters, camera_motion = FramePairParameters(kind="consecutive"), CameraMotionParameters(exact=0.7)
    memory = FramePairMemory(PERIOD, OFFSET, *((parameters, camera_motion) if given else ()))
    simulator = Simulator(memory)
    context = simulator.get_mutable_context()
    for number in range(2):
        frame = replace(NO_FRAME, sequence=number, time=float(number))
        for name, value in (("frame", frame), ("above_table", above_of(number))):
            memory.GetInputPort(name).FixValue(context, Value[object](value))
        memory.GetInputPort("flow_span").FixValue(context, [7.5])
        if wired:
            settled = FramePair(frame, frame, given_residual=0.3)
            memory.GetInputPort("settled_pair").FixValue(context, Value[object](settled))
        simulator.AdvanceTo(number * PERIOD + JUST_AFTER)
    expected = (parameters, camera_motion) if given else (FramePairParameters(), CameraMotionParameters())
    # Nothing has flowed before there is a pair. Values with arrays have no equality: their distances tell.
    assert [above.distance for above, *_ in handed] == [0.0, 1.0]
    assert [others for _, *others in handed] == [
        [0.0, *expected, 0.0],
        [7.5, *expected, 0.3 if wired else 0.0],
    ]
