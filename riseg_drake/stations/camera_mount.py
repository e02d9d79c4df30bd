"""Where the camera is bolted: to the arm's wrist, or to the world around the arm."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RollPitchYaw

MOUNTS = ("wrist", "world")


@dataclass
class CameraMount:
    """What every station's camera has in common."""

    mount: str = field(default="wrist", metadata={"choices": MOUNTS})
    """`wrist`: on the tool, where its model or `panda.X_EC` has it; `world`: on a stand, at X_WC."""
    X_WC: list[float] = field(default_factory=list, metadata={"sizes": (0, 6)})
    """With `mount: world`, the colour camera in the arm's base frame: x, y, z in m, roll, pitch, yaw in rad of
    its optical frame (x right, y down, z ahead)."""

    def check_mount(self) -> None:
        """Raise ValueError where mount and X_WC do not fit together, or the camera is nowhere near the arm."""
        if self.mount == "world" and not self.X_WC:
            raise ValueError(
                "X_WC is missing; mount: world wants x, y, z (m), roll, pitch, yaw (rad) of the camera in the "
                "arm's base frame"
            )
        if self.mount == "wrist" and self.X_WC:
            raise ValueError(
                "X_WC is given, but the camera is on the wrist; say mount: world, or use panda.X_EC"
            )
        if any(abs(length) > 5 for length in self.X_WC[:3]):
            raise ValueError(f"X_WC is {self.X_WC}; x, y, z are metres from the arm's base, at most 5")
        if any(abs(angle) > 2 * math.pi for angle in self.X_WC[3:]):
            raise ValueError(f"X_WC is {self.X_WC}; roll, pitch, yaw are radians, at most 2 pi")

    @property
    def fixed_pose(self) -> NDArray[np.float64] | None:
        """X_WC [4, 4] of a camera fixed to the world; None for one on the wrist."""
        if self.mount == "wrist":
            return None
        return RigidTransform(RollPitchYaw(self.X_WC[3:]), self.X_WC[:3]).GetAsMatrix4()
