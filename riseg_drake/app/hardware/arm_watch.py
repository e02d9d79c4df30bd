"""Looks after a real arm while the diagram runs: stops, pauses, the way on, and when contact is planned."""

import math
import time

from pydrake.systems.framework import Context

from riseg_drake.app.diagram import WiredDiagram
from riseg_drake.app.hardware.arm_travel import TravelError, WayBack, told
from riseg_drake.app.hardware.drivers import with_reasons
from riseg_drake.app.hardware.terminal_operator import TerminalOperator
from riseg_drake.app.run.interactions import Progress
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.push import NO_PUSH, Push
from riseg_drake.robot.supervisor import Cause, Mode
from riseg_drake.stations.command_process import CommandProcess
from riseg_drake.stations.command_session import StreamReport
from riseg_drake.stations.lcm_reception import Reception

CONTACT_MARGIN = 0.3
"""Before and after a push contact is still no surprise, s."""


class ArmWatch:
    """Looks after the process that commands the arm, while the diagram runs."""

    PERIOD = 0.02
    """Time between two looks, s."""
    QUIET = 10.0
    """A pause is not told again this soon, s."""

    def __init__(
        self,
        wired: WiredDiagram,
        commands: CommandProcess,
        reception: Reception,
        operator: TerminalOperator,
        progress: Progress,
        way_back: WayBack,
        off_path: float,
    ):
        """`off_path` is how far from its path the arm may go on with it, rad."""
        self._wired, self._commands, self._reception = wired, commands, reception
        self._operator, self._progress = operator, progress
        self._way_back, self._off_path = way_back, off_path
        self._push = NO_PUSH
        self._next = 0.0
        self._said = Mode.FOLLOWING, Cause.NONE
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
            if report.words == self._commands.words:  # else it is of before the operator's word
                self._ask(report)
        elif state.mode is Mode.ENDED or report.refused:
            self._progress.end = report.refused or state.cause.value
        elif state.mode is Mode.PAUSED:
            self.pauses += self._said[0] is not Mode.PAUSED
            if self._said != (state.mode, state.cause):  # a driver that ends amid a pause is news
                self._tell_pause(state.cause)
        self._said = state.mode, state.cause
        return bool(self._progress.end)

    def _tell_pause(self, cause: Cause) -> None:
        now = time.monotonic()
        if now - self._told.get(cause, -math.inf) >= self.QUIET:
            self._told[cause] = now
            self._operator.tell(f"paused: {told(cause)}")

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

    def _ask(self, report: StreamReport) -> None:
        """Have the operator say how it goes on after a stop."""
        cause = with_reasons(report.state.cause.value, self._reception)
        said = self._operator.released(f"the arm is stopped: {cause}")
        if said is None:
            return
        if said:
            self._go_on(report)
        else:
            self._progress.end = f"the arm was stopped: {cause}"

    def _go_on(self, report: StreamReport) -> None:
        """On the path where the arm is on it; else back to where it looks from, if there is a way."""
        if report.off_path <= self._off_path or report.status is None:
            self._operator.tell("the arm goes on with its path")
            self._commands.release()
            return
        try:
            seconds = self._way_back.plan(report.status.position)
        except TravelError as error:
            self._operator.tell(f"the arm stays stopped: {error}")
            return
        self._operator.tell(
            f"the arm is {report.off_path:.2f} rad off its path: it gives up what it was doing, and goes to "
            f"where it looks from in {seconds:.1f} s"
        )
        self._commands.release(anew=True)
