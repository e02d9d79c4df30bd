"""Rendered worlds, drawn once for all tests that look at them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform

from riseg_drake.geometry.rgbd import Frame, FramePair
from tests.rendered_bodies import RenderedBodies, box, camera_above, planar_pose


@dataclass(frozen=True)
class Seen:
    """A frame pair, the true labels at both times, and the motion of each body as C0 sees it."""

    pair: FramePair
    label_0: np.ndarray
    label_1: np.ndarray
    motion_C0: dict[int, np.ndarray]


class ThreeBodies:
    """Two boxes and a flat bar, close together on a white table."""

    def __init__(self, folder: Path, blank: tuple[int, ...] = ()) -> None:
        shapes = [box(0.07, 0.05, 0.04), box(0.055, 0.06, 0.05), box(0.04, 0.10, 0.02)]
        self.world = RenderedBodies(shapes, folder, blank=blank)
        self.rest = [
            planar_pose(-0.065, 0, 0.02, 0.3),
            planar_pose(0.008, 0.01, 0.025),
            planar_pose(0.07, 0, 0.01),
        ]

    def pair(
        self, moved: dict[int, RigidTransform], camera_0: RigidTransform, camera_1: RigidTransform, seed: int
    ) -> Seen:
        """Before and after the bodies numbered 1.. stand where `moved` says, with sensor noise."""
        rng = np.random.default_rng(seed)
        after = [moved.get(k + 1, X_WB) for k, X_WB in enumerate(self.rest)]
        frame_0, label_0 = self.world.frame(0, camera_0, self.rest, rng)
        frame_1, label_1 = self.world.frame(1, camera_1, after, rng)
        X_C0W = camera_0.inverse()
        motion = {
            k: (X_C0W @ after[k - 1] @ self.rest[k - 1].inverse() @ camera_0).GetAsMatrix4() for k in moved
        }
        return Seen(FramePair(frame_0, frame_1), label_0, label_1, motion)


BOTH_GO = {1: planar_pose(-0.066, 0.003, 0.02, 0.33), 2: planar_pose(0.011, 0.008, 0.025, -0.04)}
HERE, ASIDE = camera_above(0.0, 0.0, 0.42), camera_above(0.005, -0.004, 0.418, 0.01)


@pytest.fixture(scope="session")
def bodies(tmp_path_factory) -> ThreeBodies:
    return ThreeBodies(tmp_path_factory.mktemp("bodies"))


@pytest.fixture(scope="session")
def two_move(bodies: ThreeBodies) -> Seen:
    """The boxes, which all but touch, go different ways; the bar stays; the camera moves."""
    return bodies.pair(BOTH_GO, HERE, ASIDE, seed=0)


@pytest.fixture(scope="session")
def one_moves(bodies: ThreeBodies) -> Seen:
    """The second box alone moves, and the camera."""
    return bodies.pair({2: BOTH_GO[2]}, HERE, ASIDE, seed=1)


@pytest.fixture(scope="session")
def none_moves(bodies: ThreeBodies) -> Seen:
    """Only the camera moves."""
    return bodies.pair({}, HERE, ASIDE, seed=2)


@pytest.fixture(scope="session")
def blank_moves(tmp_path_factory) -> Seen:
    """As `two_move`, but the second box is one plain colour."""
    return ThreeBodies(tmp_path_factory.mktemp("blank"), blank=(1,)).pair(BOTH_GO, HERE, ASIDE, seed=3)


@pytest.fixture(scope="session")
def pushed(bodies: ThreeBodies) -> list[tuple[Frame, np.ndarray]]:
    """20 frames: all at rest at first, then the first box is pushed by 1 mm a frame and turns, then rests."""
    rng = np.random.default_rng(4)
    frames = []
    for k in range(20):
        gone = float(np.clip(k - 2, 0, 14))
        X_WB = planar_pose(-0.065 - 0.0003 * gone, 0.001 * gone, 0.02, 0.3 + 0.01 * gone)
        camera = camera_above(0.0005 * k, 0.0004 * k, 0.42)
        frames.append(bodies.world.frame(k, camera, [X_WB, *bodies.rest[1:]], rng))
    return frames
