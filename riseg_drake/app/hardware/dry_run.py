"""A dry run: every push is shown, and none is done."""

import time

import numpy as np
from rich.console import Console

from riseg_drake.app.hardware.planned_motion import PlannedMotion
from riseg_drake.app.hardware.terminal_operator import TerminalOperator, with_which_side
from riseg_drake.app.run.interactions import Progress
from riseg_drake.app.scenario import Scenario
from riseg_drake.pushing.push import Push
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.systems.arm_motion import Permission

SHOWN_FOR = 2.0
"""A push is shown for this long when nobody is asked, s."""


class DryRun:
    """A dry run's permission: every push is shown, and none is done."""

    def __init__(
        self,
        scenario: Scenario,
        planned: PlannedMotion | None,
        operator: TerminalOperator | None,
        console: Console,
        progress: Progress,
    ):
        """`operator` None: nobody is asked. Why it ends is entered in `progress`."""
        self._kinematics = PandaKinematics(scenario.hardware.panda, scenario.hardware.camera.fixed_pose)
        self._most = scenario.arm.most_interactions
        self._planned, self._operator, self._console = planned, operator, console
        self._progress = progress
        self._push: Push | None = None
        self._since = 0.0
        self._shown = 0

    def permit(self, push: Push) -> Permission:
        """SKIP once it was looked at, END after as many as a run would have."""
        if push is not self._push:
            self._push, self._since = push, time.monotonic()
            self._shown += 1
            self._describe(push)
        if self._planned is not None:
            self._planned.show(push)
        if self._operator is None:
            if time.monotonic() - self._since < SHOWN_FOR:
                return Permission.WAIT
        else:
            said = self._operator.answer(f"push {self._shown}: n for another, q to end", "n q")
            if not said:
                return Permission.WAIT
            if said != "n":
                return self._end(self._operator.why_quit)
        if self._shown < self._most:
            return Permission.SKIP
        return self._end(f"{self._shown} of {self._most} pushes were shown, and none was done")

    def _end(self, why: str) -> Permission:
        self._progress.end = why
        if self._planned is not None:
            self._planned.hide()
        return Permission.END

    def _describe(self, push: Push) -> None:
        assert push.path is not None
        times = np.linspace(0, push.path.duration, 50)
        lowest = min(self._kinematics.clearance(push.path.position(t)) for t in times)
        x, y = push.p_WB[:2]
        self._console.print(
            f"push {self._shown} at ({x:.3f}, {y:.3f}) m{with_which_side(push)}, "
            f"tip at z = {push.p_WE[2]:.3f} m, {push.path.duration:.1f} s, nothing nearer than "
            f"{1e3 * lowest:.0f} mm to table or arm"
        )
