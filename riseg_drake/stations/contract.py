"""The ports by which every station, simulated or real, is wired."""

from dataclasses import dataclass

from pydrake.systems import sensors
from pydrake.systems.framework import Diagram, InputPort, OutputPort, PortDataType

GROUND_TRUTH = "cheat."
"""Outputs of this prefix exist in simulation only; no stage of the algorithm is ever wired to one."""


@dataclass(frozen=True)
class StationPort:
    """One port: a vector of `size`, or an image of the class of that name in pydrake.systems.sensors."""

    name: str
    size: int = 0
    image: str = ""

    def __str__(self) -> str:
        return f"{self.name} ({self.image or f'vector of {self.size}'})"


STATION_INPUTS = (StationPort("panda.position", size=7),)
"""Commanded joint angles, rad."""

STATION_OUTPUTS = (
    StationPort("wrist.color_image", image="ImageRgba8U"),
    StationPort("wrist.depth_image", image="ImageDepth32F"),  # m, aligned to colour, 0 = invalid
    StationPort("wrist.image_time", size=1),  # s, when the two were taken; negative before the first
    StationPort("panda.position_measured", size=7),  # rad
    StationPort("panda.velocity_measured", size=7),  # rad/s
)


def check_contract(station: Diagram) -> None:
    """Raise ValueError, naming every difference, unless a station has exactly the ports agreed on."""
    problems = []
    inputs = {port.get_name(): port for port in map(station.get_input_port, range(station.num_input_ports()))}
    outputs = {
        port.get_name(): port for port in map(station.get_output_port, range(station.num_output_ports()))
    }
    for kind, agreed, present in (
        ("input", STATION_INPUTS, inputs),
        ("output", STATION_OUTPUTS, outputs),
    ):
        for port in agreed:
            if port.name not in present:
                problems.append(f"{kind} {port} is missing")
            elif not _fits(present[port.name], port):
                problems.append(f"{kind} {port} has another type or size")
        strangers = set(present) - {port.name for port in agreed}
        problems += [
            f"{kind} {name} is not in the contract; name ground truth {GROUND_TRUTH}*"
            for name in sorted(strangers)
            if kind == "input" or not name.startswith(GROUND_TRUTH)
        ]
    if problems:
        raise ValueError(f"station {station.get_name()}: " + "; ".join(problems))


def _fits(port: InputPort | OutputPort, agreed: StationPort) -> bool:
    if not agreed.image:
        return port.get_data_type() == PortDataType.kVectorValued and port.size() == agreed.size
    # Only an output can show what it carries before it is wired; the contract has no image inputs.
    return isinstance(port, OutputPort) and isinstance(
        port.Allocate().get_value(), getattr(sensors, agreed.image)
    )
