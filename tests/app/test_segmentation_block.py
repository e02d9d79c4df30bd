"""Alg. 2 wired to a simulated station: every picture, with the joint angles of its instant."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus
from pydrake.systems.primitives import ConstantVectorSource

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.segmentation_block import STATION_PORTS, add_segmentation
from riseg_drake.geometry.se3 import inverse
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.stations import wrist_camera
from riseg_drake.stations.simulated import SimulatedStation, start_position

pytestmark = pytest.mark.renders


@pytest.mark.parametrize(("rate", "time_step"), [(15.0, 0.002), (10.0, 0.004), (25.0, 0.0008)])
def test_every_picture_is_a_frame_with_the_pose_of_its_instant(monkeypatch, rate, time_step):
    """The camera's own tick, the look for its picture and the plant's steps must never coincide."""
    poses = []

    def measured(color, depth, config, rng, X_WM, seed):
        poses.append(X_WM)
        return color, depth

    monkeypatch.setattr(wrist_camera, "measured_images", measured)
    scenario = Scenario()
    camera = scenario.station.camera
    camera.width, camera.height, camera.cx, camera.cy = 64, 48, 32.0, 24.0
    camera.rate, scenario.station.time_step = rate, time_step
    builder = DiagramBuilder()
    station = builder.AddSystem(SimulatedStation(scenario.station, objects=[]))
    block = add_segmentation(builder, scenario, PandaKinematics(scenario.station.panda), seed=0)
    for name, port in STATION_PORTS.items():
        builder.Connect(station.GetOutputPort(port), block.inputs[name])
    turned = start_position(scenario.station) + 0.3 * np.eye(7)[0]
    command = builder.AddSystem(ConstantVectorSource(turned))
    builder.Connect(command.get_output_port(), station.GetInputPort("panda.position"))
    builder.ExportOutput(block.outputs["pair"], "pair")
    diagram = builder.Build()
    frames = {}

    def note(context):
        frame = diagram.GetOutputPort("pair").Eval(context).current
        if frame.time >= 0:
            frames[frame.time] = frame.X_WC
        return EventStatus.DidNothing()

    simulator = Simulator(diagram)
    simulator.set_monitor(note)
    simulator.AdvanceTo(8.5 / rate)
    assert len(frames) == len(poses) == 9
    np.testing.assert_allclose(list(frames), np.arange(9) / rate, atol=1e-3)
    # The camera is fixed to what it is mounted on, which turns. (The first picture is older than any step.)
    X_MC = [inverse(X_WM) @ X_WC for X_WM, X_WC in zip(poses[1:], list(frames.values())[1:], strict=True)]
    np.testing.assert_allclose(X_MC, np.broadcast_to(X_MC[0], (8, 4, 4)), atol=1e-12)
    assert np.linalg.norm(poses[-1][:3, 3] - poses[0][:3, 3]) > 0.01
