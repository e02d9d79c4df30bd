"""Looks after a real arm while the diagram runs: stops, pauses, and when contact is planned."""

import math
import time

from pydrake.systems.framework import Context

from riseg_drake.app.diagram import WiredDiagram
from riseg_drake.app.interactions import Progress
from riseg_drake.app.terminal_operator import TerminalOperator
from riseg_drake.pushing.push import NO_PUSH, ArmPhase, Push
from riseg_drake.robot.supervisor import Cause, Mode
from riseg_drake.stations.command_process import CommandProcess

CONTACT_MARGIN = 0.3
"""Before and after a push contact is still no surprise, s."""


class ArmWatch:
    """Looks after the process that commands the arm, while the diagram runs."""

    PERIOD = 0.02
    """Time between two looks, s."""
    QUIET = 10.0
    """A pause is not told again this soon, s."""

    def __init__(
        self, wired: WiredDiagram, commands: CommandProcess, operator: TerminalOperator, progress: Progress
    ):
        self._wired, self._commands, self._operator, self._progress = wired, commands, operator, progress
        self._push = NO_PUSH
        self._next = 0.0
        self._said = Mode.FOLLOWING
        self._told: dict[Cause, float] = {}
        self.pauses = 0
        """How often the arm has paused so far."""

    def __call__(self, context: Context) -> bool:
        """Whether the run has come to its end."""
        self._announce_contact(context)
        if time.monotonic() < self._next:
            return False
        self._next = time.monotonic() + self.PERIOD
        report = self._commands.report
        if report is None:
            return False
        state = report.state
        if state.mode is Mode.STOPPED:
            self._ask(state.cause.value)
        elif state.mode is Mode.ENDED or report.refused:
            self._progress.end = report.refused or state.cause.value
        elif state.mode is Mode.PAUSED and self._said is not Mode.PAUSED:
            self._tell_pause(state.cause)
        self._said = state.mode
        return bool(self._progress.end)

    def _tell_pause(self, cause: Cause) -> None:
        self.pauses += 1
        now = time.monotonic()
        if now - self._told.get(cause, -math.inf) >= self.QUIET:
            self._told[cause] = now
            self._operator.tell(f"paused: {cause.value}")

    def _announce_contact(self, context: Context) -> None:
        push: Push = self._wired.read("active_push", context)
        if push is self._push or push.path is None:
            return
        if self._wired.phase(context) not in (ArmPhase.APPROACH, ArmPhase.PUSH):
            return
        self._push = push
        start = context.get_time()
        self._commands.expect_contact(
            start + push.path.push_start - CONTACT_MARGIN, start + push.path.push_end + CONTACT_MARGIN
        )

    def _ask(self, cause: str) -> None:
        """Have the operator say how it goes on after a stop."""
        said = self._operator.released(f"the arm is stopped: {cause}")
        if said is None:
            return
        if said:
            self._commands.release()
        else:
            self._progress.end = f"the arm was stopped: {cause}"
