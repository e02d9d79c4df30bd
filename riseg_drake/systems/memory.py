"""A system's memory: one value that nobody changes, and that each update may replace."""

from pydrake.systems.framework import AbstractStateIndex, Context, EventStatus, State


def replace_memory(context: Context, state: State, index: AbstractStateIndex, following: object) -> EventStatus:
    """Make `following` the value of an abstract state; where it is that already, nothing is done."""
    if following is context.get_abstract_state(int(index)).get_value():
        return EventStatus.DidNothing()
    state.get_mutable_abstract_state(int(index)).set_value(following)
    return EventStatus.Succeeded()
