"""From where the arm stands to where it looks from, and other motions that no push needs."""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from pydrake.trajectories import PiecewisePolynomial

from riseg_drake.app.hardware.drivers import with_reasons
from riseg_drake.app.hardware.terminal_operator import TerminalOperator
from riseg_drake.geometry.se3 import translation
from riseg_drake.pushing.time_law import SpeedLimits, minimum_jerk, rest_to_rest
from riseg_drake.robot.kinematics import MIN_CLEARANCE, PandaKinematics
from riseg_drake.robot.supervisor import Cause, Mode
from riseg_drake.stations.command_process import CommandProcess
from riseg_drake.stations.hardware import TARGET_PERIOD
from riseg_drake.stations.lcm_reception import Reception

ARRIVED = 0.01
"""The arm is where it should be when every joint is this close, rad."""
LINGER = 1.0
"""Targets go on for this long at the end of a motion, s: the last ones are never reached."""
PATIENCE = 60.0
"""A motion may take so much longer than planned, s: a driver that died has to be started by hand."""
ROOM = 0.01
"""Arm and tool keep this far from the table and from each other on the way, m."""


class TravelError(RuntimeError):
    """The arm does not get there; says in one line why."""


def told(cause: Cause) -> str:
    """Why the arm does not move, and what to do about it where the cause alone does not say that."""
    if cause is Cause.STATUS_OLD:
        return (
            f"{cause.value}; a driver that has ended must be started again: `riseg drive-arm`, or "
            "drake-franka-driver with station.command.mode as its --control_mode (with another one it ends at "
            "the first command)"
        )
    return cause.value


def straight_motion(
    kinematics: PandaKinematics, q_from: NDArray, q_to: NDArray, limits: SpeedLimits
) -> PiecewisePolynomial:
    """From rest to rest on the straight line between two postures [7]. Raises TravelError if it is not free."""
    steps = max(int(np.ceil(np.abs(q_to - q_from).max() / 0.03)), 4)
    way = q_from + np.linspace(0, 1, steps + 1)[:, None] * (q_to - q_from)
    if min(kinematics.clearance(q) for q in way[1:]) < ROOM:
        raise TravelError(
            "the straight way to the observation posture comes too near to the table or to the arm itself; "
            "guide the arm by hand to nearer to it, tool down and well above the objects"
        )
    return rest_to_rest(way, minimum_jerk, limits, kinematics.limits)


class WayBack:
    """To where the arm looks from, from wherever somebody has put it: planned by one, begun by another."""

    ABOVE = 0.25
    """Things on the table are taken to be lower than this, m: the tip goes so high before it goes anywhere
    else ..."""
    RISE, HIGHEST = 0.02, 0.5
    """... and up to the other height where the straight way is not free before, each time by the one, m."""

    def __init__(
        self, kinematics: PandaKinematics, q_observe: NDArray, limits: SpeedLimits, commands: CommandProcess
    ):
        """`q_observe` [7], rad, is where the arm looks from; `limits` are of planned motions."""
        self._kinematics, self._q_observe, self._limits = kinematics, q_observe, limits
        self._commands = commands
        self._motion: PiecewisePolynomial | None = None

    def plan(self, q_from: NDArray) -> float:
        """Find a way from a posture [7], rad; returns how long it takes, s. Raises TravelError."""
        rise, X_WE = [q_from], self._kinematics.X_WE(q_from)
        free = min(MIN_CLEARANCE, self._kinematics.clearance(q_from))
        can_rise = True
        while True:
            can_rise = can_rise and X_WE[2, 3] < self.HIGHEST
            if X_WE[2, 3] >= self.ABOVE or not can_rise:
                try:
                    across = straight_motion(self._kinematics, rise[-1], self._q_observe, self._limits)
                except TravelError:
                    if not can_rise:
                        raise
                else:
                    self._motion = self._joined(rise, across)
                    return self._motion.end_time()
            X_WE = translation(np.array([0.0, 0.0, self.RISE])) @ X_WE
            traced = self._kinematics.trace_ik([X_WE], rise[-1], min_clearance=free)
            can_rise = traced is not None
            rise.extend(traced or [])

    def take(self) -> PiecewisePolynomial | None:
        """The motion that was found, once: its targets are what the arm hears from now on."""
        motion, self._motion = self._motion, None
        if motion is not None:
            self._commands.begin_path()
        return motion

    def _joined(self, rise: list[NDArray], across: PiecewisePolynomial) -> PiecewisePolynomial:
        if len(rise) == 1:
            return across
        motion = rest_to_rest(np.array(rise), minimum_jerk, self._limits, self._kinematics.limits)
        across.shiftRight(motion.end_time())
        motion.ConcatenateInTime(across)
        return motion


def travel(
    plan: Callable[[NDArray], PiecewisePolynomial],
    commands: CommandProcess,
    reception: Reception,
    operator: TerminalOperator,
    look: Callable[[], None] = lambda: None,
) -> None:
    """Have a motion done, and wait until the arm has arrived; `look` is called all the while.

    `plan` finds it from where the arm is, rad [7]; after a stop once more, at the operator's word.

    Raises TravelError if the arm is stopped on its way and the operator does not want it to go on.
    """
    assert reception.status is not None
    stop = _travel_once(plan(reception.status.position), commands, reception, look, operator.tell)
    while stop:
        said = operator.released(stop)
        if said is None:
            time.sleep(0.02)
        elif not said:
            raise TravelError(stop)
        else:
            try:
                motion = plan(reception.status.position)
            except TravelError as error:
                operator.tell(f"the arm stays stopped: {error}")
                continue
            commands.release(anew=True)
            commands.begin_path()
            stop = _travel_once(motion, commands, reception, look, operator.tell)


def _travel_once(
    motion: PiecewisePolynomial,
    commands: CommandProcess,
    reception: Reception,
    look: Callable[[], None],
    tell: Callable[[str], None],
) -> str:
    """Why the arm was stopped on its way, in a line; empty where it has arrived; else raises TravelError."""
    clock, duration = reception.clock, motion.end_time()
    start = clock()
    for t in np.arange(0, duration + LINGER, TARGET_PERIOD):
        commands.send_target(start + t, motion.value(min(t, duration))[:, 0])
    goal = motion.value(duration)[:, 0]
    deadline = time.monotonic() + duration + PATIENCE
    is_paused = False
    while time.monotonic() < deadline:
        look()
        time.sleep(0.02)
        report = commands.report
        if report is None or report.words != commands.words:  # it is of before the operator's word
            continue
        stop = f"the arm is stopped: {with_reasons(told(report.state.cause), reception)}"
        if report.state.mode is Mode.ENDED:
            raise TravelError(stop)
        if report.state.mode is Mode.STOPPED:
            return stop
        if report.state.mode is Mode.PAUSED and not is_paused:
            tell(f"paused: {told(report.state.cause)}")
        is_paused = report.state.mode is Mode.PAUSED
        arrived = report.status is not None and np.abs(report.status.position - goal).max() < ARRIVED
        if arrived and report.behind == 0 and report.at_rest and clock() > start + duration + LINGER:
            return ""
    cause = told(report.state.cause) or "it did not arrive in time" if report else "it says nothing"
    raise TravelError(f"the arm did not get to where it should: {cause}")
