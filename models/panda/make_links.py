"""Make the shells of the Panda's links: `python models/panda/make_links.py`.

A shell is the convex hull of a few rounded drums, one about each joint axis that the link carries and
one at each seam to a neighbour. The drums stand where the arm's published joint offsets put them
(0.333, 0.316, 0.0825, 0.384, 0.088 and 0.107 m), with the thickness of the real arm (11 to 12 cm).
Being convex, a shell is exactly what `RobotSilhouette` projects, and a few hundred triangles draw fast.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

SEGMENTS = 32
CREASE = np.deg2rad(35.0)
"""Faces that meet at less than this are shaded as one smooth surface."""


@dataclass(frozen=True)
class Drum:
    """A cylinder with rounded rims in the link's frame, metres."""

    centre: tuple[float, float, float]
    axis: str
    radius: float
    half_length: float
    rim: float = 0.008
    """Radius of the rounding."""
    squeeze: float = 1.0
    """Second half axis of the cross section over the first."""

    def points(self) -> NDArray:
        """Points on the surface, [N, 3]."""
        angles = np.linspace(0, 2 * np.pi, SEGMENTS, endpoint=False)
        rings = []
        for bend in np.linspace(0, np.pi / 2, 4):
            radius = self.radius - self.rim * (1 - np.cos(bend))
            height = self.half_length - self.rim * (1 - np.sin(bend))
            circle = [radius * np.cos(angles), self.squeeze * radius * np.sin(angles)]
            rings += [np.stack([*circle, np.full(SEGMENTS, side * height)], -1) for side in (-1, 1)]
        # The cylinder is built along z; a cyclic shift of the coordinates lays it along x or y.
        shift = {"z": 0, "x": 1, "y": 2}[self.axis]
        return np.roll(np.concatenate(rings), shift, axis=1) + self.centre


@dataclass(frozen=True)
class Slab:
    """A box with upright edges cut at 45 degrees, metres."""

    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    cut: float

    def points(self) -> NDArray:
        """The 16 corners, [16, 3]."""
        x, y, z = (s / 2 for s in self.size)
        corners = [(x, y - self.cut), (x - self.cut, y)]
        return np.array(
            [
                (sx * px, sy * py, sz * z)
                for px, py in corners
                for sx in (-1, 1)
                for sy in (-1, 1)
                for sz in (-1, 1)
            ]
        ) + np.array(self.centre)


SHELLS: dict[str, list[Drum | Slab]] = {
    "link0_base": [
        Slab((-0.035, 0, 0.01), (0.215, 0.19, 0.02), 0.05),
        Drum((0, 0, 0.07), "z", 0.072, 0.02),
        Drum((-0.09, 0, 0.055), "z", 0.045, 0.02),
    ],
    "link0_column": [Drum((0, 0, 0.09), "z", 0.06, 0.05)],
    # Shoulder: two equal shells on either side of joint 2, one hanging, one standing.
    "link1_shell": [Drum((0, 0, -0.165), "z", 0.058, 0.027), Drum((0, -0.06, 0), "y", 0.058, 0.055)],
    "link1_cap": [Drum((0, -0.117, 0), "y", 0.044, 0.007, 0.005)],
    "link2_shell": [Drum((0, -0.165, 0), "y", 0.058, 0.027), Drum((0, 0, 0.06), "z", 0.058, 0.055)],
    "link2_cap": [Drum((0, 0, 0.117), "z", 0.044, 0.007, 0.005)],
    # Elbow: joint 4 stands 82.5 mm ahead of the upper arm's axis and of the forearm's.
    "link3_shell": [Drum((0, 0, -0.1), "z", 0.057, 0.024), Drum((0.0825, 0.055, 0), "y", 0.052, 0.05)],
    "link3_cap": [Drum((0.0825, 0.107, 0), "y", 0.04, 0.007, 0.005)],
    "link4_shell": [Drum((-0.0825, 0.1, 0), "y", 0.057, 0.024), Drum((0, 0, 0.055), "z", 0.052, 0.05)],
    "link4_cap": [Drum((0, 0, 0.107), "z", 0.04, 0.007, 0.005)],
    # Forearm: a sleeve that narrows into a fin beside the wrist, and the fin's drum on joint 6.
    "link5_sleeve": [
        Drum((0, 0, -0.235), "z", 0.057, 0.024),
        Drum((0, 0.032, -0.155), "z", 0.042, 0.014),
    ],
    "link5_fin": [
        Drum((0, 0.044, -0.17), "z", 0.038, 0.02),
        Drum((0, 0.075, -0.09), "z", 0.034, 0.02),
        Drum((0, 0.09, 0), "y", 0.05, 0.035),
    ],
    "link5_cap": [Drum((0, 0.127, 0), "y", 0.038, 0.006, 0.004)],
    # Wrist: from the drum on joint 6 across 88 mm to the motor that stands on joint 7.
    "link6_shell": [Drum((0, 0, 0), "z", 0.05, 0.05, 0.02), Drum((0.088, 0.012, 0), "y", 0.048, 0.052)],
    "link6_motor": [Drum((0.088, 0.068, 0), "y", 0.04, 0.014, 0.01)],
    "link6_cap": [Drum((0, 0, 0.053), "z", 0.038, 0.006, 0.004)],
    "link7_shell": [
        Drum((0, 0, 0.069), "z", 0.045, 0.025),
        Drum((0.037, 0.037, 0.08), "z", 0.022, 0.012),
    ],
    "link7_buttons": [Drum((0.042, 0.042, 0.094), "z", 0.013, 0.004, 0.002)],
    "link7_flange": [Drum((0, 0, 0.1), "z", 0.0315, 0.007, 0.002)],
}


def smooth_normals(vertices: NDArray, triangles: NDArray) -> NDArray:
    """Normals at the corners of triangles, [N, 3, 3]: flat across creases, smooth elsewhere."""
    edges = vertices[triangles]
    area_normals = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
    face_normals = area_normals / np.linalg.norm(area_normals, axis=1, keepdims=True)
    normals = np.empty((len(triangles), 3, 3))
    for vertex in np.unique(triangles):
        faces, corners = np.nonzero(triangles == vertex)
        alike = face_normals[faces] @ face_normals[faces].T > np.cos(CREASE)
        blended = alike @ area_normals[faces]
        normals[faces, corners] = blended / np.linalg.norm(blended, axis=1, keepdims=True)
    return normals


def write_hull(path: Path, points: NDArray) -> None:
    """Write the convex hull of points [N, 3] as a Wavefront OBJ file."""
    hull = ConvexHull(points)
    triangles = hull.simplices.copy()
    # Qhull leaves the winding open: turn every triangle to look outward.
    corners = points[triangles]
    winding = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("ij,ij->i", winding, hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    used, triangles = np.unique(triangles, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    vertices = points[used]
    normals, normal_index = np.unique(
        smooth_normals(vertices, triangles).round(3).reshape(-1, 3), axis=0, return_inverse=True
    )
    normal_index = normal_index.reshape(-1, 3)
    lines = ["# made by make_links.py"]
    lines += [f"v {x:.5g} {y:.5g} {z:.5g}" for x, y, z in vertices.round(5) + 0.0]
    lines += [f"vn {x:.3g} {y:.3g} {z:.3g}" for x, y, z in normals + 0.0]
    for triangle, normal in zip(triangles + 1, normal_index + 1, strict=True):
        lines.append("f " + " ".join(f"{v}//{n}" for v, n in zip(triangle, normal, strict=True)))
    path.write_text("\n".join(lines) + "\n")


def main() -> None:
    """Write one OBJ file a shell into `meshes/` beside this script."""
    folder = Path(__file__).parent / "meshes"
    folder.mkdir(exist_ok=True)
    for name, parts in SHELLS.items():
        write_hull(folder / f"{name}.obj", np.concatenate([part.points() for part in parts]))


if __name__ == "__main__":
    main()
