"""A system's memory is replaced, or it is not touched at all."""

from dataclasses import dataclass

import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import EventStatus, LeafSystem

from riseg_drake.geometry.rgbd import Immutable
from riseg_drake.systems.memory import replace_memory


@dataclass(frozen=True)
class Thought(Immutable):
    """Something to remember; two may be equal without being the same."""

    words: str


FIRST, OTHER = Thought("first"), Thought("other")


class Mind(LeafSystem):
    """Remembers, every second, what it is told to; its output counts how often it is worked out."""

    def __init__(self, following: Thought) -> None:
        super().__init__()
        self.following, self.statuses, self.calls = following, [], 0
        self.beside = self.DeclareAbstractState(AbstractValue.Make(OTHER))
        self.memory = self.DeclareAbstractState(AbstractValue.Make(FIRST))
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0, 0.0, self._update)
        self.DeclareAbstractOutputPort(
            "thought", AbstractValue.Make(FIRST).Clone, self._calc, {self.all_state_ticket()}
        )

    def _update(self, context, state) -> EventStatus:
        self.statuses.append(replace_memory(context, state, self.memory, self.following))
        return self.statuses[-1]

    def _calc(self, context, output) -> None:
        self.calls += 1
        output.set_value(context.get_abstract_state(int(self.memory)).get_value())


@pytest.mark.parametrize(
    ("following", "severity"),
    [(FIRST, "kDidNothing"), (Thought("first"), "kSucceeded"), (Thought("second"), "kSucceeded")],
    ids=["the same", "an equal one", "another"],
)
def test_only_what_is_another_value_is_written_and_makes_what_follows_from_it_anew(following, severity) -> None:
    mind = Mind(following)
    simulator = Simulator(mind)
    context = simulator.get_context()
    simulator.AdvanceTo(0.5)
    assert mind.get_output_port().Eval(context) is following
    seen = mind.calls
    mind.following = mind.get_output_port().Eval(context)
    simulator.AdvanceTo(1.5)  # at 1 s once more, with the same value
    assert [status.severity().name for status in mind.statuses] == [severity, "kDidNothing"]
    assert mind.get_output_port().Eval(context) is following
    assert mind.calls == seen
    assert context.get_abstract_state(int(mind.beside)).get_value() is OTHER
