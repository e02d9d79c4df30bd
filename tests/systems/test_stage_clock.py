import pytest
from pydrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem

from riseg_drake.systems import stage_clock
from riseg_drake.systems.stage_clock import StageClock, timed


class Time:
    """A time that passes only when someone works."""

    now = 0.0


@pytest.fixture(autouse=True)
def time(monkeypatch):
    monkeypatch.setattr(Time, "now", 0.0)
    monkeypatch.setattr(stage_clock, "perf_counter", lambda: Time.now)


class Slow(LeafSystem):
    """Adds one to its input, and takes its time over it."""

    def __init__(self, name, seconds):
        super().__init__()
        self.set_name(name)
        self.seconds = seconds
        self.DeclareVectorInputPort("u", 1)
        self.DeclareVectorOutputPort("y", BasicVector(1), self._calc, {self.all_input_ports_ticket()})

    @timed
    def _calc(self, context, output):
        u = self.get_input_port().Eval(context)
        Time.now += self.seconds
        output.SetFromVector(u + 1)


@pytest.fixture
def chain():
    builder = DiagramBuilder()
    first = builder.AddSystem(Slow("First", 2.0))
    second = builder.AddSystem(Slow("Second", 0.5))
    builder.Connect(first.get_output_port(), second.get_input_port())
    builder.ExportInput(first.get_input_port())
    builder.ExportOutput(second.get_output_port())
    return builder.Build()


def evaluate(diagram):
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, [1.0])
    value = diagram.get_output_port().Eval(context)
    diagram.get_output_port().Eval(context)
    return value


def test_a_stage_is_booked_once_a_call_and_without_the_stages_it_waits_for(chain):
    clock = StageClock()
    clock.watch(chain.GetSystems())
    assert evaluate(chain) == 3
    assert clock.seconds == {"First": [2.0], "Second": [0.5]}


def test_without_a_clock_a_stage_works_as_ever(chain):
    assert evaluate(chain) == 3


def test_a_stage_that_fails_leaves_the_clock_in_order():
    clock = StageClock()
    with pytest.raises(ZeroDivisionError):
        clock.measure("Outer", lambda: clock.measure("Inner", lambda: 1 / 0))
    clock.measure("Outer", lambda: None)
    assert clock.seconds == {"Inner": [0.0], "Outer": [0.0, 0.0]}
