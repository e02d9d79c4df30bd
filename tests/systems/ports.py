"""Names of a system's ports, and evaluating one with the others fixed."""

from typing import Any

from pydrake.common.value import Value
from pydrake.systems.framework import System


def port_names(system: System) -> tuple[list[str], list[str]]:
    """Of the inputs and of the outputs, in order."""
    return (
        [system.get_input_port(k).get_name() for k in range(system.num_input_ports())],
        [system.get_output_port(k).get_name() for k in range(system.num_output_ports())],
    )


def evaluate(system: System, output: str, **inputs: Any) -> Any:
    """The output's value, where untyped inputs are given by name."""
    context = system.CreateDefaultContext()
    for name, value in inputs.items():
        system.GetInputPort(name).FixValue(context, Value[object](value))
    return system.GetOutputPort(output).Eval(context)
