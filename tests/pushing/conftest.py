"""Tables drawn from boxes and discs: as maps, and as a camera above would see them."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.pushing.table_map import TableMap
from riseg_drake.robot.kinematics import PandaKinematics

CAMERA = Intrinsics(640, 480, 616.285, 615.778, 301.418, 232.864)
CELL = 0.002
ORIGIN = np.array([0.2, -0.3])
SHAPE = (301, 301)


@dataclass
class DrawnTable:
    """Draw things, then take the map."""

    objects: np.ndarray = field(default_factory=lambda: np.zeros(SHAPE, bool))
    segmented: np.ndarray = field(default_factory=lambda: np.zeros(SHAPE, bool))
    height: np.ndarray = field(default_factory=lambda: np.zeros(SHAPE, np.float32))
    doubtful: np.ndarray = field(default_factory=lambda: np.zeros(SHAPE, int))
    work_area: tuple = (0.25, 0.75, -0.28, 0.28)

    def box(self, x, y, width, depth, yaw=0.0, height=0.05, segmented=False, doubtful=0):
        offset = self.centres() - [x, y]
        c, s = np.cos(yaw), np.sin(yaw)
        local = offset @ np.array([[c, -s], [s, c]])
        return self.put((np.abs(local) <= [width / 2, depth / 2]).all(-1), height, segmented, doubtful)

    def disc(self, x, y, radius, hole=0.0, height=0.05, segmented=False, doubtful=0):
        distance = np.linalg.norm(self.centres() - [x, y], axis=-1)
        return self.put((distance <= radius) & (distance >= hole), height, segmented, doubtful)

    def put(self, cells, height, segmented, doubtful=0):
        self.objects[cells] = True
        self.height[cells] = height
        self.segmented[cells] = segmented
        self.doubtful[cells] = doubtful
        return self

    @staticmethod
    def centres():
        i, j = np.mgrid[: SHAPE[0], : SHAPE[1]]
        return ORIGIN + CELL * np.stack([j, i], axis=-1)

    def map(self):
        return TableMap(
            ORIGIN,
            CELL,
            self.objects,
            self.segmented,
            self.height,
            np.ones(SHAPE, bool),
            self.work_area,
            doubtful=self.doubtful,
        )


@pytest.fixture(scope="session")
def new_table():
    """Called, an empty table to draw on."""
    return DrawnTable


@pytest.fixture
def drawn(new_table):
    return new_table()


@dataclass(frozen=True)
class View:
    """What a camera at X_WC sees of boxes (x, y, width, depth, height) on the table z = 0."""

    X_WC: np.ndarray
    depth: np.ndarray
    objects: np.ndarray
    height: np.ndarray
    number: np.ndarray
    intrinsics: Intrinsics = CAMERA


@pytest.fixture
def view():
    def look(boxes, **camera):
        X_WC = camera_above(**camera)
        return View(X_WC, *seen_boxes(X_WC, boxes))

    return look


def camera_above(x=0.5, y=0.0, z=0.5, tilt=0.0):
    """X_WC of a camera that looks down, image "up" along W's x, tilted about the image's u axis."""
    c, s = np.cos(tilt), np.sin(tilt)
    R_WC = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    X_WC = np.eye(4)
    X_WC[:3, :3] = R_WC @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    X_WC[:3, 3] = [x, y, z]
    return X_WC


def seen_boxes(X_WC, boxes):
    """Depth, objMask, height and box number [H, W] of boxes (x, y, width, depth, height) on z = 0."""
    ray_W = rays(CAMERA).astype(float) @ X_WC[:3, :3].T
    eye_W = X_WC[:3, 3]
    depth = -eye_W[2] / ray_W[..., 2]
    number = np.zeros(CAMERA.shape, np.uint16)
    for n, (x, y, width, length, top) in enumerate(boxes, 1):
        lower = np.array([x - width / 2, y - length / 2, 0.0])
        upper = np.array([x + width / 2, y + length / 2, top])
        with np.errstate(divide="ignore"):
            t = np.sort(np.stack([(lower - eye_W) / ray_W, (upper - eye_W) / ray_W]), axis=0)
        enter, leave = t[0].max(-1), t[1].min(-1)
        hit = (enter < leave) & (enter < depth)
        depth[hit], number[hit] = enter[hit], n
    height = (eye_W[2] + depth * ray_W[..., 2]).astype(np.float32)
    return depth.astype(np.float32), number > 0, height, number


@pytest.fixture(scope="session")
def panda():
    return PandaKinematics()
