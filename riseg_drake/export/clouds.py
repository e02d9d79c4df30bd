"""A coloured point cloud of each object, fused over frames, in the world frame W.

    clouds/object_3.ply     x y z in metres, float32; red green blue, 8 bits; binary

PLY as https://paulbourke.net/dataformats/ply/ describes it; an own writer, because it is a header of ten lines
before an array.

Fused are the frames in which nothing moves and the mask has been decided on: in motion both depth and poses
are worse, and an outline may be late. Points are taken back to the object's first pose, averaged in voxels
there, and at the end taken to its last pose. Of an object whose motion is not known only what was seen since
things last came to rest is fused; of one that was never seen at rest, the last frame that shows it.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from riseg_drake.export.segmented_frame import SegmentedFrame
from riseg_drake.geometry.camera import rays
from riseg_drake.geometry.se3 import inverse, move_points
from riseg_drake.recording.whole_file import write_bytes


@dataclass
class CloudParameters:
    """How points are thinned."""

    voxel: float = 0.002
    """Edge of a voxel, m: a pixel of a camera with 600 pixels of focal length at 1.2 m."""


@dataclass
class VoxelCloud:
    """Means of points and colours in voxels; memory grows with the surface, not with the number of frames."""

    voxel: float
    """Edge, m."""
    key: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 3), np.int64))
    """[N, 3], rising, each once."""
    sum: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 7)))
    """[N, 7], of x, y, z, red, green, blue, 1."""

    def add(self, p_BQ: NDArray, color: NDArray[np.uint8]) -> None:
        """Fuse points [M, 3] in metres, and their colours [M, 3]."""
        new = np.column_stack([p_BQ, color, np.ones(len(p_BQ))])
        key = np.concatenate([self.key, np.floor(p_BQ / self.voxel).astype(np.int64)])
        total = np.concatenate([self.sum, new])
        self.key, place = np.unique(key, axis=0, return_inverse=True)
        self.sum = np.zeros((len(self.key), 7))
        np.add.at(self.sum, place.ravel(), total)

    @property
    def points(self) -> NDArray[np.float64]:
        """[N, 3], m."""
        return self.sum[:, :3] / self.sum[:, 6:]

    @property
    def colors(self) -> NDArray[np.uint8]:
        """[N, 3], RGB."""
        return np.rint(self.sum[:, 3:6] / self.sum[:, 6:]).astype(np.uint8)


@dataclass
class _Object:
    cloud: VoxelCloud
    """In the object's first pose where that is known, else in W."""
    X_W: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    """[4, 4], takes the points to the last known pose."""
    at_rest: bool = False
    known: bool = False
    """Whether its motion is."""


class CloudExport:
    """Fuses what it takes, and writes the clouds at the end. Raises OSError where it cannot."""

    def __init__(self, folder: Path, parameters: CloudParameters | None = None):
        self._folder = folder
        self._voxel = (parameters or CloudParameters()).voxel
        self._objects: dict[int, _Object] = {}
        self._rest: float | None = None

    def take(
        self, frame: SegmentedFrame, displacement: Mapping[int, NDArray], rest_since: float | None
    ) -> None:
        """Fuse one frame.

        Args:
            frame: with its mask.
            displacement: by id, the motion in W [4, 4] since the first pose; none where it is not known.
            rest_since: time since which nothing moves and the mask is decided, s; None in motion.
        """
        points = {a: _points(frame, a) for a in frame.object_ids}
        for a, (p_WQ, color) in points.items():
            known = a in displacement
            there = self._objects.get(a)
            at_rest = rest_since is not None
            if there is not None and there.at_rest and not at_rest:
                continue  # better ones are there
            fuses = there is not None and there.at_rest and there.known == known
            if there is None or not fuses or (not known and rest_since != self._rest):
                there = self._objects[a] = _Object(VoxelCloud(self._voxel))
            X_W = displacement[a] if known else np.eye(4)
            there.cloud.add(move_points(inverse(X_W), p_WQ), color)
            there.X_W, there.at_rest, there.known = X_W, at_rest, known
        for a, X_W in displacement.items():
            if a in self._objects and self._objects[a].known:
                self._objects[a].X_W = X_W
        if rest_since is not None:
            self._rest = rest_since

    def clouds(self) -> dict[int, tuple[NDArray[np.float64], NDArray[np.uint8]]]:
        """By id, points p_WQ [N, 3] in metres and colours [N, 3], each object in its last known pose."""
        return {
            a: (move_points(each.X_W, each.cloud.points), each.cloud.colors)
            for a, each in sorted(self._objects.items())
            if len(each.cloud.key)
        }

    def finish(self, ids: Collection[int]) -> list[str]:
        """Write the files of some ids; says which of them have no point with depth."""
        clouds = self.clouds()
        for a in sorted(clouds.keys() & set(ids)):
            p_WQ, color = clouds[a]
            self._folder.mkdir(parents=True, exist_ok=True)
            write_bytes(self._folder / f"object_{a}.ply", ply(p_WQ, color))
        return [f"clouds: no file for object {a}: no pixel of it has depth" for a in ids if a not in clouds]


def ply(points: NDArray, colors: NDArray[np.uint8]) -> bytes:
    """A binary PLY file of points [N, 3] in metres, as float32, with colours [N, 3], RGB."""
    vertex = np.empty(len(points), [(n, "<f4") for n in "xyz"] + [(n, "u1") for n in ("red", "green", "blue")])
    for k, name in enumerate(vertex.dtype.names or ()):
        vertex[name] = np.column_stack([points, colors])[:, k]
    kinds = {"<f4": "float", "|u1": "uchar"}
    properties = [f"property {kinds[vertex.dtype[n].str]} {n}" for n in vertex.dtype.names or ()]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        "comment world frame W, metres",
        f"element vertex {len(points)}",
        *properties,
        "end_header",
    ]
    return "\n".join(header).encode() + b"\n" + vertex.tobytes()


def _points(frame: SegmentedFrame, object_id: int) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Points p_WQ [N, 3] and colours [N, 3] of the pixels of an object that have depth."""
    seen = (frame.mask == object_id) & (frame.depth > 0)
    p_CQ = rays(frame.intrinsics)[seen].astype(float) * frame.depth[seen, None]
    return move_points(frame.X_WC, p_CQ), frame.color[seen]
