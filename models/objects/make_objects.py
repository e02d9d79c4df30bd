"""Draw the toys: for each a textured mesh, convex collision pieces and an SDF with its mass properties.

    python -m riseg_drake.models.objects.make_objects [OUTPUT]

writes one folder a toy; without OUTPUT, beside this file. The same program writes the same bytes again.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.objects.collision import FOOT_RADIUS, convex_pieces, feet
from riseg_drake.models.objects.outlines import trace
from riseg_drake.models.objects.solids import Mesh, mass_properties, solid
from riseg_drake.models.objects.texture import painted, plain_obj, write_png
from riseg_drake.models.objects.toys import TOYS, Toy
from riseg_drake.models.sdf import collision, convex_mesh, fresh_folder, make_all, sdf

TEXTURE_RESOLUTION = 0.36  # mm a texel: half of what a pixel sees from 0.45 m
MM = 1e-3
STIFFNESS = """
          <drake:point_contact_stiffness>2e4</drake:point_contact_stiffness>
          <drake:hunt_crossley_dissipation>2.0</drake:hunt_crossley_dissipation>"""


@dataclass(frozen=True)
class Body:
    """Mass (kg), centre of mass (m) and inertia about it (kg m^2) of one toy."""

    mass: float
    centre: NDArray
    inertia: NDArray


def make_toy(toy: Toy, folder: Path) -> None:
    """Write one toy's files into `folder`, which is made if need be."""
    fresh_folder(folder, toy.name)
    rng = np.random.default_rng(sum(toy.name.encode()))
    loops = trace(toy.drawing)
    mesh = solid(loops, toy.profile, rng)
    volume, centre, inertia = mass_properties(mesh.vertices, mesh.faces)
    shift = np.array([*centre[:2], 0.0])  # the origin of the body: under its centre of mass, on the table
    texture, chart = painted(mesh.chart, toy.pattern, rng, TEXTURE_RESOLUTION)
    write_png(folder / f"{toy.name}.png", texture)
    (folder / f"{toy.name}.mtl").write_text(_material(toy.name))
    (folder / f"{toy.name}.obj").write_text(_textured_obj(toy.name, mesh, mesh.vertices - shift, chart))
    pieces = convex_pieces(loops, toy.profile)
    for k, (vertices, faces) in enumerate(pieces):
        (folder / f"{toy.name}_piece_{k}.obj").write_text(plain_obj(vertices - shift, faces))
    body = Body(toy.density * volume * MM**3, (centre - shift) * MM, toy.density * inertia * MM**5)
    (folder / f"{toy.name}.sdf").write_text(_sdf(toy, body, feet(loops, toy.profile) - shift, len(pieces)))


def _material(name: str) -> str:
    return f"newmtl {name}\nKa 1 1 1\nKd 1 1 1\nKs 0.05 0.05 0.05\nNs 10\nd 1\nillum 2\nmap_Kd {name}.png\n"


def _textured_obj(name: str, mesh: Mesh, vertices: NDArray, chart: NDArray) -> str:
    lines = [f"mtllib {name}.mtl", f"usemtl {name}"]
    lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in vertices * MM]
    lines += [f"vt {u:.4f} {v:.4f}" for u, v in chart]
    lines += [f"vn {x:.3f} {y:.3f} {z:.3f}" for x, y, z in mesh.normals]
    lines += [f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}" for a, b, c in mesh.faces + 1]
    return "\n".join(lines) + "\n"


def _sdf(toy: Toy, body: Body, foot_centres: NDArray, piece_count: int) -> str:
    feet_and_pieces = {
        f"foot_{k}": f"""<pose>{x * MM:.5f} {y * MM:.5f} {z * MM:.5f} 0 0 0</pose>
        <geometry><sphere><radius>{FOOT_RADIUS * MM:.5f}</radius></sphere></geometry>"""
        for k, (x, y, z) in enumerate(foot_centres)
    } | {f"piece_{k}": convex_mesh(f"{toy.name}_piece_{k}.obj") for k in range(piece_count)}
    return sdf(
        toy.name,
        mass=f"{body.mass:.5f}",
        centre=body.centre,
        inertia=body.inertia,
        visual=f"{toy.name}.obj",
        collisions=[collision(name, shape, toy.friction, STIFFNESS) for name, shape in feet_and_pieces.items()],
    )


def main() -> None:
    """Command line: draw every toy."""
    make_all(TOYS, make_toy, Path(__file__).parent, "Draw the toys: meshes, textures, SDF.")


if __name__ == "__main__":
    main()
