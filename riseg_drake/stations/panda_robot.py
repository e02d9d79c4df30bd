"""A Panda or Franka Research 3 as its control box moves it: by commands, by itself, or in a person's hands."""

import numpy as np
from drake import lcmt_panda_status
from numpy.typing import NDArray

from riseg_drake.robot.limits import RobotLimits
from riseg_drake.stations.rate_limiter import TICK, RateLimiter

IDLE = lcmt_panda_status.kIdle
MOVE = lcmt_panda_status.kMove
GUIDING = lcmt_panda_status.kGuiding
REFLEX = lcmt_panda_status.kReflex
USER_STOPPED = lcmt_panda_status.kUserStopped

HAND_SPEED = 0.3
"""A person guides the arm no faster than this, rad/s, ..."""
_HAND_GAIN = 10.0  # 1/s; ... slows down towards the end ...
_HAND_REACH = 1e-4  # rad; ... and lets go when every joint is so near to it


class PandaRobot:
    """One tick of the robot at a time: `follow` while it is controlled, `stand` while it is not.

    `q_d`, `v_d`, `a_d` [7] are what it sets itself (rad, rad/s, rad/s^2). `mode` is one of IDLE, MOVE, GUIDING,
    REFLEX and USER_STOPPED; `reflex_reason` is libfranka's word for the last reflex.
    """

    def __init__(self, limits: RobotLimits, q: NDArray):
        self.limits = limits
        self.limiter = RateLimiter(limits)
        self.q_d = np.array(q, np.float64)
        self.v_d = np.zeros(7)
        self.a_d = np.zeros(7)
        self.mode: int = IDLE
        self.reflex_reason = ""
        self._guided_to: NDArray[np.float64] | None = None
        self._mode_before_guiding: int = IDLE

    @property
    def is_moving(self) -> bool:
        """Whether any joint is faster than 1 mrad/s."""
        return bool(np.abs(self.v_d).max() > 1e-3)

    def begin_control(self) -> bool:
        """Take commands from now on; False where the robot is not idle, and refuses."""
        if self.mode != IDLE:
            return False
        self.mode, self.reflex_reason = MOVE, ""
        return True

    def end_control(self) -> None:
        """Take no commands any more, and come to rest."""
        if self.mode == MOVE:
            self.mode = IDLE

    def enter_reflex(self, reason: str) -> None:
        """Stop by itself, until `recover`; `reason` in libfranka's words. Not while it is stopped already."""
        if self.mode in (MOVE, IDLE):
            self.mode, self.reflex_reason = REFLEX, reason

    def user_stop(self) -> None:
        """Somebody presses the stop button."""
        self._guided_to = None
        self.mode = USER_STOPPED

    def recover(self) -> None:
        """The stop button is released, the reflex is forgiven."""
        if self.mode in (REFLEX, USER_STOPPED):
            self.mode = IDLE

    def guide(self, q: NDArray) -> None:
        """Somebody takes the arm by the hand and leads it to q [7], rad.

        Raises ValueError while it is controlled, and for angles that it cannot have.
        """
        if self.mode == MOVE:
            raise ValueError("the arm is controlled: end that first")
        if not self.limits.contains(q):
            raise ValueError("a joint cannot go there")
        if self.mode != GUIDING:
            self._mode_before_guiding = self.mode
        self.mode, self._guided_to = GUIDING, np.array(q, np.float64)

    def follow(self, v: NDArray) -> None:
        """One tick with the velocity [7], rad/s, that a client asks for and libfranka lets through."""
        self._go(v)
        if not self.limits.contains(self.q_d):
            self.enter_reflex("joint_position_limits_violation")

    def stand(self) -> None:
        """One tick of coming to rest, staying there, or being led by the hand."""
        v = np.zeros(7)
        if self._guided_to is not None:
            way = self._guided_to - self.q_d
            if np.abs(way).max() < _HAND_REACH:
                self._guided_to, self.mode = None, self._mode_before_guiding
            else:
                v = np.clip(_HAND_GAIN * way, -HAND_SPEED, HAND_SPEED)
        self._go(self.limiter.limit(v, self.q_d, self.v_d, self.a_d))

    def _go(self, v: NDArray) -> None:
        self.a_d = (v - self.v_d) / TICK
        self.v_d = v
        self.q_d = self.q_d + TICK * v
