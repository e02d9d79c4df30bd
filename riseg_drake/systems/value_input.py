"""Input ports for values of a Python class, which Drake does not tell apart.

`AbstractValue.Make` makes a `Value[object]` of whatever is not Drake's own: such a port can be connected to any
other, and what is wrong shows wherever it is used. So the class is looked at where a value comes in.
"""

from typing import Any, Generic, TypeVar

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem

T = TypeVar("T")


class ValueInput(Generic[T]):
    """An abstract input port for values of one class, that of a model value."""

    def __init__(self, system: LeafSystem, name: str, model: T, takes: Any = None) -> None:
        """`takes` is another class than that of the `model`, or a protocol that can be checked."""
        self._port = system.DeclareAbstractInputPort(name, AbstractValue.Make(model))
        self._class = takes or type(model)

    def Eval(self, context: Context) -> T:
        """The value. Raises TypeError, with the names of system and port, for one of another class."""
        value: Any = self._port.Eval(context)
        if not isinstance(value, self._class):
            raise TypeError(
                f"input port {self._port.get_name()} of {self._port.get_system().get_name()} takes"
                f" {self._class.__module__}.{self._class.__qualname__}, not {type(value).__qualname__}"
            )
        return value

    def HasValue(self, context: Context) -> bool:
        """Whether it is connected."""
        return bool(self._port.HasValue(context))
