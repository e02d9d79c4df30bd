"""The arm in the browser, drawn from its joint angles alone: there is no simulation of a real one."""

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, InputPort
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from riseg_drake.robot.description import PandaDescription, add_panda


def add_arm_view(
    builder: DiagramBuilder,
    panda: PandaDescription,
    X_WC: NDArray[np.float64] | None,
    meshcat: Meshcat,
    parameters: MeshcatVisualizerParams,
) -> InputPort:
    """Show the arm, and a camera that is fixed to the world at X_WC [4, 4].

    The port takes joint angles, rad [7].
    """
    plant = MultibodyPlant(0.0)
    scene_graph = builder.AddSystem(SceneGraph())
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    add_panda(plant, panda, X_WC)
    plant.Finalize()
    poses = builder.AddSystem(MultibodyPositionToGeometryPose(plant))
    builder.Connect(poses.get_output_port(), scene_graph.get_source_pose_port(plant.get_source_id()))
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, parameters)
    return poses.get_input_port()
