"""A push before it is done: the way of the tip, and an arm of glass that does it again and again."""

from collections.abc import Callable

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizerParams, Rgba, Role, SceneGraph
from pydrake.systems.framework import Diagram, DiagramBuilder

from riseg_drake.app.scenario import Scenario
from riseg_drake.pushing.push import Push
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.stations.arm_view import add_arm_view

PATH = "/riseg/planned"
GLASS = 0.35
"""Opacity of the arm that does not move yet."""
PAUSE = 1.0
"""Between the end of the motion and its beginning, s."""
BEFORE = 0.05
"""So long before it is shown a thing is said to be hidden, s: in a replay it is so from the beginning, then."""
POINTS = 200
"""Of the way of the tip."""
WAY_COLOR = Rgba(0.84, 0.37, 0.0)


class PlannedMotion:
    """Plays what the arm is going to do, at wall time, for whoever is to permit it."""

    def __init__(self, scenario: Scenario, meshcat: Meshcat, clock: Callable[[], float]):
        """`clock` tells wall time as the diagram counts it, s: a replay keeps the motion at that time."""
        self._meshcat, self._clock = meshcat, clock
        panda, X_WC = scenario.hardware.panda, scenario.hardware.camera.fixed_pose
        self._kinematics = PandaKinematics(panda, X_WC)
        self._push: Push | None = None
        self._since = 0.0
        self._way = ""
        self._number = 0  # of the ways that were shown
        builder = DiagramBuilder()
        angles = add_arm_view(builder, panda, X_WC, meshcat, MeshcatVisualizerParams(prefix=f"{PATH}/arm"))
        builder.ExportInput(angles, "position")
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._parts = _drawn_parts(self._diagram)

    def show(self, push: Push) -> None:
        """To be called again and again: the arm of glass is where the motion would be by now."""
        assert push.path is not None
        now = self._clock()
        if push is not self._push:
            self._push, self._since = push, now
            times = np.linspace(0, push.path.duration, POINTS)
            way = np.array([self._kinematics.X_WE(push.path.position(t))[:3, 3] for t in times])
            self._show_way(way, now)
            self._place(push.path.position(0.0), now)
            # Of each part by itself: a page that is opened later gets what is around a part before the part.
            for part in self._parts:
                self._meshcat.SetProperty(f"{PATH}/arm/{part}", "modulated_opacity", GLASS)
            if self._number == 1:
                self._meshcat.SetProperty(PATH, "visible", False, now - BEFORE)
            self._meshcat.SetProperty(PATH, "visible", True, now)
        passed = (now - self._since) % (push.path.duration + PAUSE)
        self._place(push.path.position(min(passed, push.path.duration)), now)

    def hide(self) -> None:
        """It was decided on."""
        if self._push is not None:
            self._push = None
            self._meshcat.SetProperty(PATH, "visible", False, self._clock())

    def _show_way(self, p_WE: np.ndarray, now: float) -> None:
        """Show the way [N, 3], m, of this push alone: a recording keeps visibility, not a line that changes."""
        if self._way:
            self._meshcat.SetProperty(self._way, "visible", False, now)
        self._number += 1
        self._way = f"{PATH}/way/{self._number}"
        self._meshcat.SetLine(self._way, p_WE.T, 3.0, WAY_COLOR)
        self._meshcat.SetProperty(self._way, "visible", False, now - BEFORE)
        self._meshcat.SetProperty(self._way, "visible", True, now)

    def _place(self, q: np.ndarray, now: float) -> None:
        self._diagram.get_input_port().FixValue(self._context, q)
        self._context.SetTime(now)
        self._diagram.ForcedPublish(self._context)


def _drawn_parts(diagram: Diagram) -> list[str]:
    """What a MeshcatVisualizer calls the shapes of a diagram that it draws."""
    (scene_graph,) = (system for system in diagram.GetSystems() if isinstance(system, SceneGraph))
    inspector = scene_graph.model_inspector()
    shapes = inspector.GetAllGeometryIds(Role.kIllustration)
    names = [(inspector.GetName(inspector.GetFrameId(shape)), inspector.GetName(shape)) for shape in shapes]
    return [f"{frame}/{name}".replace("::", "/") for frame, name in names]
