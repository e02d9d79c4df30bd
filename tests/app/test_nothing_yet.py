"""No port and no state of any diagram holds None, which since Drake 1.58 no Value can.

Only systems written in Python can: everything else has values of C++ classes.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.geometry import Meshcat
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, PortDataType
from pydrake.systems.sensors import ImageDepth32F, ImageRgba8U

import riseg_drake
from riseg_drake.app import refinement_block
from riseg_drake.app.diagram import Drivers, make_diagram
from riseg_drake.app.scenario import HARDWARE, load_scenario
from riseg_drake.app.segmentation_block import make_segmentation, panda_view
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.robot.kinematics import READY, PandaKinematics
from riseg_drake.stations.even_clock import EvenClock
from riseg_drake.stations.ideal_arm import status_message
from riseg_drake.stations.lcm_images import encode_images
from riseg_drake.stations.lcm_reception import Reception
from riseg_drake.systems.frame_view import FrameView
from riseg_drake.systems.mask_refiner import NO_REFINED_MASK
from tests.segmentation.drawn_scene import CAMERA, DrawnScene, looking_down, planar

pytestmark = pytest.mark.renders

FUTURE = 4_000_000_000.0
"""A wall time ahead of the clock, s, so that a hardware station never has to catch up."""


def leaves(system):
    """The systems of a diagram that are no diagrams themselves."""
    if not isinstance(system, Diagram):
        return [system]
    return [leaf for part in system.GetSystems() for leaf in leaves(part)]


def abstract_ports(system):
    """(port, its value as declared) of all abstract ports through which Python objects go, as None would."""
    inputs = map(system.get_input_port, range(system.num_input_ports()))
    outputs = map(system.get_output_port, range(system.num_output_ports()))
    declared = [(port, system.AllocateInputAbstract) for port in inputs]
    declared += [(port, lambda port: port.Allocate()) for port in outputs]
    for port, allocate in declared:
        if port.get_data_type() == PortDataType.kAbstractValued and isinstance(allocate(port), Value[object]):
            yield port, allocate(port).get_value()


def strays(system, context):
    """What holds None, or a value of another class than it was declared with."""
    for port, declared in abstract_ports(system):
        held = port.Eval(context) if not hasattr(port, "HasValue") or port.HasValue(context) else declared
        if declared is None or type(held) is not type(declared):
            yield f"{system.get_name()}.{port.get_name()}: {type(held).__name__}, not {type(declared).__name__}"
    for k in range(context.num_abstract_states()):
        state = context.get_abstract_state(k)
        if isinstance(state, Value[object]) and state.get_value() is None:
            yield f"{system.get_name()}, state {k}"


def walk(diagram, root):
    """Evaluate all that can be evaluated in a diagram."""
    assert [stray for leaf in leaves(diagram) for stray in strays(leaf, leaf.GetMyContextFromRoot(root))] == []


def simulation(small_scenario, folder, monkeypatch, meshcat):
    """Everything that a scenario can have wired, with a refinement that is done at once."""
    monkeypatch.setattr(refinement_block, "sam_refinement", lambda parameters: lambda frame, mask: mask)
    path = folder / "refined.yaml"
    path.write_text(small_scenario.read_text() + f"sam: {{folder: {folder}}}\n")
    return make_diagram(load_scenario(path), seed=1, meshcat=meshcat)


def show(diagram, context, color, depth, time, **others):
    """Fix the inputs of a segmentation on its own."""
    height, width = depth.shape
    color_image, depth_image = ImageRgba8U(width, height), ImageDepth32F(width, height)
    color_image.mutable_data[..., :3], depth_image.mutable_data[..., 0] = color, depth
    images = {"color_image": Value(color_image), "depth_image": Value(depth_image), "image_time": [time]}
    for name, value in {**images, **others}.items():
        diagram.GetInputPort(name).FixValue(context, value)


def test_a_simulation_with_refiner_and_browser_before_it_runs_and_when_a_push_is_under_way(
    small_scenario, tmp_path, monkeypatch
):
    wired = simulation(small_scenario, tmp_path, monkeypatch, Meshcat())
    simulator = Simulator(wired.diagram)
    context = simulator.get_mutable_context()
    walk(wired.diagram, context)
    assert wired.read("active_push", context) is NO_PUSH
    assert wired.refined(context) is NO_REFINED_MASK
    simulator.AdvanceTo(1.0)
    walk(wired.diagram, context)
    assert wired.phase(context) is ArmPhase.APPROACH
    assert wired.read("active_push", context) is not NO_PUSH
    assert wired.refined(context) is not NO_REFINED_MASK


def test_a_robot_before_its_first_picture_and_after():
    scenario = load_scenario(None, HARDWARE)
    lcm, config = DrakeLcm("memq://"), scenario.hardware
    now = FUTURE
    reception = Reception(lcm, config.lcm, clock=EvenClock(lambda: now, lambda: now))
    wired = make_diagram(scenario, seed=0, meshcat=Meshcat(), drivers=Drivers(reception))
    simulator = Simulator(wired.diagram)
    context = simulator.get_mutable_context()
    context.SetTime(FUTURE)
    walk(wired.diagram, context)
    simulator.AdvanceTo(FUTURE + 0.2)
    walk(wired.diagram, context)
    color, depth = np.full((480, 848, 3), 100, np.uint8), np.full((480, 848), 0.5, np.float32)
    for time in (FUTURE + 0.2, FUTURE + 0.3, FUTURE + 0.4):
        now = time + 0.01
        lcm.Publish(config.lcm.status_channel, status_message(time - 0.01, READY).encode())
        lcm.Publish(config.lcm.status_channel, status_message(time + 0.01, READY).encode())
        lcm.Publish(config.lcm.image_channel, encode_images(color, depth, time, time, 0).encode())
        reception.listen()
        simulator.AdvanceTo(time + 0.09)
    assert wired.pair(context).current.sequence > 0
    walk(wired.diagram, context)


@pytest.mark.parametrize("from_joints", [True, False], ids=["from joint angles", "as recorded"])
def test_a_segmentation_on_its_own_before_its_first_picture_and_after(from_joints, small_scenario):
    scenario, scene = load_scenario(small_scenario), DrawnScene([(0.07, 0.06, 0.03)])
    frames = [
        scene.frame(k, looking_down(), [planar(-0.05, 0.004 * k)], np.random.default_rng(k))[0]
        for k in range(2)
    ]
    if from_joints:  # as a run's recording, and as `riseg bench`
        view, others = panda_view(scenario, PandaKinematics()), {"position": READY}
    else:
        view = FrameView(CAMERA, None, None)
        given = {"camera_pose": looking_down(), "robot_pixels": np.zeros(CAMERA.shape, bool)}
        others = {name: Value[object](value) for name, value in given.items()}
    diagram, _ = make_segmentation(scenario, view, 0.1, seed=0)
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    show(diagram, context, np.zeros((0, 0, 3), np.uint8), np.zeros((0, 0), np.float32), -1.0, **others)
    walk(diagram, context)
    for number, frame in enumerate(frames):
        show(diagram, context, frame.color, frame.depth, number, **others)
        simulator.AdvanceTo(0.1 * number + 0.05)
    assert diagram.GetOutputPort("segmentation").Eval(context).sequence == 1
    walk(diagram, context)


def test_these_are_all_the_systems_that_there_are(small_scenario, tmp_path, monkeypatch):
    sources = [path.read_text() for path in Path(riseg_drake.__file__).parent.rglob("*.py")]
    there_are = {name for source in sources for name in re.findall(r"^class (\w+)\(LeafSystem\)", source, re.M)}
    diagrams = [
        simulation(small_scenario, tmp_path, monkeypatch, Meshcat()).diagram,
        make_diagram(load_scenario(None, HARDWARE), seed=0).diagram,
    ]
    walked = {type(leaf).__name__ for diagram in diagrams for leaf in leaves(diagram)}
    assert len(there_are) >= 15
    # Others wire clouds of objects for what comes after; its own tests see it before the first frame.
    assert there_are - {"ObjectClouds"} <= walked
