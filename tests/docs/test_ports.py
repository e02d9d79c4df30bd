"""The port tables of docs/systems.md, and the docstrings, against the systems themselves."""

import inspect
import pkgutil
import re
from importlib import import_module

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm
from pydrake.systems import sensors
from pydrake.systems.framework import LeafSystem, PortDataType

import riseg_drake.systems
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.robot.kinematics import READY, PandaKinematics
from riseg_drake.stations.contract import STATION_INPUTS, STATION_OUTPUTS
from riseg_drake.stations.hardware import HardwareStation, HardwareStationConfig
from riseg_drake.stations.lcm_reception import Reception
from riseg_drake.systems.arm_motion import ArmMotion
from riseg_drake.systems.bfif_grouper import BFIFGrouper
from riseg_drake.systems.camera_motion import CameraMotion
from riseg_drake.systems.expected_flow import ExpectedFlow
from riseg_drake.systems.frame_pair import FramePairMemory
from riseg_drake.systems.frame_reducer import FrameReducer
from riseg_drake.systems.frame_view import FrameView
from riseg_drake.systems.mask_propagator import MaskPropagator
from riseg_drake.systems.mask_refiner import MaskRefiner
from riseg_drake.systems.object_clouds import ObjectClouds
from riseg_drake.systems.objects_above_table import ObjectsAboveTable
from riseg_drake.systems.optical_flow import OpticalFlow
from riseg_drake.systems.push_planner import PushPlanner
from tests.docs.pages import CHECKOUT, section, table_rows
from tests.systems.ports import port_names

PAGE = CHECKOUT / "docs" / "systems.md"
SMALL = Intrinsics(32, 24, 30.0, 30.0, 15.5, 11.5)

MAKE = {
    FrameView: lambda: FrameView(SMALL, lambda q: q, lambda q: q),
    FrameReducer: lambda: FrameReducer(320),
    ObjectsAboveTable: ObjectsAboveTable,
    FramePairMemory: lambda: FramePairMemory(0.1, 0.001),
    CameraMotion: CameraMotion,
    ExpectedFlow: ExpectedFlow,
    OpticalFlow: OpticalFlow,
    BFIFGrouper: BFIFGrouper,
    MaskPropagator: lambda: MaskPropagator(SMALL, 0.1, 0.001),
    ObjectClouds: lambda: ObjectClouds(SMALL),
    MaskRefiner: lambda: MaskRefiner(lambda frame, mask: mask, 0.1, 0.001),
    PushPlanner: lambda: PushPlanner(PandaKinematics()),
    ArmMotion: lambda: ArmMotion(READY),
}


def documented(heading):
    """(name, direction, type) of every port in a section's tables."""
    return [(row[0].strip("`"), *row[1:3]) for row in table_rows(section(PAGE, heading)) if len(row) == 4]


def name_of_class(value):
    """As the tables have it; of an array that of its numbers."""
    if isinstance(value, np.ndarray):
        return value.dtype.name
    return type(value).__name__


def assert_same(tables, system):
    """Names, order, directions, kinds and classes as the system has them."""
    inputs, outputs = port_names(system)
    for direction, real in (("in", inputs), ("out", outputs)):
        rows = [row for row in tables if re.split(r"\W", row[1])[0] == direction]
        assert [row[0] for row in rows] == real
        for name, _, kind in rows:
            port = system.GetInputPort(name) if direction == "in" else system.GetOutputPort(name)
            vector = re.match(r"vector of (\d+)", kind)
            assert (port.get_data_type() == PortDataType.kVectorValued) == bool(vector), name
            if vector:
                assert port.size() == int(vector[1]), name
            else:
                allocated = port.Allocate() if direction == "out" else system.AllocateInputAbstract(port)
                declared = allocated.get_value()
                if image := re.match(r"Image\w+", kind):
                    assert isinstance(declared, getattr(sensors, image[0])), name
                else:
                    assert name_of_class(declared) in re.findall(r"\w+", kind), name


def test_every_system_has_a_section():
    found = set()
    for module in pkgutil.iter_modules(riseg_drake.systems.__path__, "riseg_drake.systems."):
        for _, thing in inspect.getmembers(import_module(module.name), inspect.isclass):
            if issubclass(thing, LeafSystem) and thing.__module__ == module.name:
                found.add(thing)
    assert found == set(MAKE)
    headings = re.findall(r"^## (\w+)$", PAGE.read_text(), re.M)
    assert {system.__name__ for system in found} <= set(headings)


@pytest.mark.parametrize("system", [s for s in MAKE if s is not FrameView], ids=lambda s: s.__name__)
def test_the_table_has_the_ports_that_the_system_has(system):
    assert_same(documented(system.__name__), MAKE[system]())


@pytest.mark.parametrize("given", [True, False], ids=["from joint angles", "given"])
def test_the_table_of_frame_view_has_the_ports_of_both_its_forms(given):
    rows = documented("FrameView")
    instead = ("camera_pose", "robot_pixels")
    absent = instead if given else ("position",)
    calc = (lambda q: q) if given else None
    assert_same([row for row in rows if row[0] not in absent], FrameView(SMALL, calc, calc))


@pytest.mark.parametrize("system", MAKE, ids=lambda s: s.__name__)
def test_the_docstring_names_the_ports_of_the_table(system):
    text = inspect.getdoc(system)
    for heading, direction in (("Inputs", "in"), ("Outputs", "out")):
        listed = re.search(rf"^{heading}:\n((?:    .*\n?|\n)+)", text, re.M)[1]
        names = re.findall(r"^    (\w+): ", listed, re.M)
        rows = documented(system.__name__)
        assert names == [row[0] for row in rows if re.split(r"\W", row[1])[0] == direction]


def test_the_stations_table_is_the_contract_and_what_a_station_has():
    rows = documented("Stations")
    contract = [row for row in rows if "simulated" not in row[1]]
    config = HardwareStationConfig()
    assert_same(contract, HardwareStation(config, Reception(DrakeLcm("memq://"), config.lcm)))
    assert [row[0] for row in contract] == [port.name for port in STATION_INPUTS + STATION_OUTPUTS]


@pytest.mark.renders
def test_the_table_of_ground_truth_is_what_a_simulated_station_has_beyond_the_contract():
    from riseg_drake.stations.simulated import SimulatedStation, SimulatedStationConfig

    _, outputs = port_names(SimulatedStation(SimulatedStationConfig()))
    cheats = {row[0] for row in documented("Stations") if "simulated" in row[1]}
    assert cheats == {name for name in outputs if name.startswith("cheat.")}
