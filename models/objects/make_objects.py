"""Draw the toys: for each a textured mesh, convex collision pieces and an SDF with its mass properties.

    python -m riseg_drake.models.objects.make_objects [OUTPUT]

writes one folder a toy; without OUTPUT, beside this file. The same program writes the same bytes again.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.objects.collision import FOOT_RADIUS, convex_pieces, feet
from riseg_drake.models.objects.outlines import trace
from riseg_drake.models.objects.solids import Mesh, mass_properties, solid
from riseg_drake.models.objects.texture import painted, plain_obj, write_png
from riseg_drake.models.objects.toys import TOYS, Toy

TEXTURE_RESOLUTION = 0.36  # mm a texel: half of what a pixel sees from 0.45 m
MM = 1e-3


@dataclass(frozen=True)
class Body:
    """Mass (kg), centre of mass (m) and inertia about it (kg m^2) of one toy."""

    mass: float
    centre: NDArray
    inertia: NDArray


def make_toy(toy: Toy, folder: Path) -> None:
    """Write one toy's files into `folder`, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    for stale in folder.glob(f"{toy.name}*"):
        stale.unlink()
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
    i = body.inertia
    surface = f"""<drake:proximity_properties>
          <drake:point_contact_stiffness>2e4</drake:point_contact_stiffness>
          <drake:hunt_crossley_dissipation>2.0</drake:hunt_crossley_dissipation>
          <drake:mu_static>{toy.friction}</drake:mu_static>
          <drake:mu_dynamic>{toy.friction}</drake:mu_dynamic>
        </drake:proximity_properties>"""
    collisions = [
        f"""
      <collision name="foot_{k}">
        <pose>{x * MM:.5f} {y * MM:.5f} {z * MM:.5f} 0 0 0</pose>
        <geometry><sphere><radius>{FOOT_RADIUS * MM:.5f}</radius></sphere></geometry>
        {surface}
      </collision>"""
        for k, (x, y, z) in enumerate(foot_centres)
    ] + [
        f"""
      <collision name="piece_{k}">
        <geometry><mesh><uri>{toy.name}_piece_{k}.obj</uri><drake:declare_convex/></mesh></geometry>
        {surface}
      </collision>"""
        for k in range(piece_count)
    ]
    return f"""<?xml version="1.0"?>
<sdf version="1.9" xmlns:drake="http://drake.mit.edu">
  <model name="{toy.name}">
    <link name="{toy.name}">
      <inertial>
        <pose>{body.centre[0]:.6f} {body.centre[1]:.6f} {body.centre[2]:.6f} 0 0 0</pose>
        <mass>{body.mass:.5f}</mass>
        <inertia>
          <ixx>{i[0, 0]:.6e}</ixx><iyy>{i[1, 1]:.6e}</iyy><izz>{i[2, 2]:.6e}</izz>
          <ixy>{i[0, 1]:.6e}</ixy><ixz>{i[0, 2]:.6e}</ixz><iyz>{i[1, 2]:.6e}</iyz>
        </inertia>
      </inertial>
      <visual name="visual">
        <geometry><mesh><uri>{toy.name}.obj</uri></mesh></geometry>
      </visual>{"".join(collisions)}
    </link>
  </model>
</sdf>
"""


def main() -> None:
    """Command line: draw every toy."""
    parser = argparse.ArgumentParser(description="Draw the toys: meshes, textures, SDF.")
    parser.add_argument("output", nargs="?", type=Path, default=Path(__file__).parent)
    output = parser.parse_args().output
    for toy in TOYS:
        make_toy(toy, output / toy.name)


if __name__ == "__main__":
    main()
