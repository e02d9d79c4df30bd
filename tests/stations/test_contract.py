import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource, ConstantVectorSource, PassThrough
from pydrake.systems.sensors import ImageDepth32F, ImageLabel16I, ImageRgba8U

from riseg_drake.stations.contract import check_contract

SOURCES = {
    "wrist.color_image": Value(ImageRgba8U(4, 4)),
    "wrist.depth_image": Value(ImageDepth32F(4, 4)),
    "wrist.image_time": np.zeros(1),
    "panda.position_measured": np.zeros(7),
    "panda.velocity_measured": np.zeros(7),
}


def station(**changes):
    """A station without anything behind its ports; None leaves a port out."""
    builder = DiagramBuilder()
    sink = builder.AddSystem(PassThrough(changes.pop("command_size", 7)))
    builder.ExportInput(sink.get_input_port(), "panda.position")
    for name, value in (SOURCES | {k.replace("__", "."): v for k, v in changes.items()}).items():
        if value is not None:
            kind = ConstantVectorSource if isinstance(value, np.ndarray) else ConstantValueSource
            builder.ExportOutput(builder.AddSystem(kind(value)).get_output_port(), name)
    diagram = builder.Build()
    diagram.set_name("station")
    return diagram


def test_the_ports_agreed_on_pass_with_ground_truth_beside_them():
    check_contract(station(cheat__label_image=Value(ImageLabel16I(4, 4))))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"wrist__image_time": None}, r"output wrist\.image_time \(vector of 1\) is missing"),
        ({"wrist__depth_image": Value(ImageRgba8U(4, 4))}, r"depth_image \(ImageDepth32F\) has another"),
        ({"panda__velocity_measured": np.zeros(6)}, r"velocity_measured \(vector of 7\) has another"),
        ({"command_size": 6}, r"input panda\.position \(vector of 7\) has another"),
        ({"label_image": Value(ImageLabel16I(4, 4))}, r"label_image is not in the contract"),
    ],
)
def test_a_port_that_differs_is_named(changes, message):
    with pytest.raises(ValueError, match=message):
        check_contract(station(**changes))
