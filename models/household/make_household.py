"""Make the household things: for each a surface with a texture and a gloss, convex collision shapes, an SDF.

    python -m riseg_drake.models.household.make_household [OUTPUT]

writes one folder a thing; without OUTPUT, beside this file. The same program writes the same pictures again.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.household.bodies import Body
from riseg_drake.models.household.gltf import gltf_text
from riseg_drake.models.household.things import THINGS, Thing
from riseg_drake.models.objects.texture import MM, plain_obj, write_png


def make_thing(thing: Thing, folder: Path) -> None:
    """Write one thing's files into `folder`, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    for stale in folder.glob(f"{thing.name}*"):
        stale.unlink()
    body = thing.make(np.random.default_rng(sum(thing.name.encode())))
    write_png(folder / f"{thing.name}.png", body.texture)
    text = gltf_text(body.surface, f"{thing.name}.png", thing.roughness, thing.metallic)
    (folder / f"{thing.name}.gltf").write_text(text)
    for k, (vertices, faces) in enumerate(body.hulls):
        (folder / f"{thing.name}_piece_{k}.obj").write_text(plain_obj(vertices, faces))
    (folder / f"{thing.name}.sdf").write_text(_sdf(thing, body))


def _sdf(thing: Thing, body: Body) -> str:
    density = thing.mass / body.volume  # kg/mm^3
    i = density * MM**2 * body.inertia
    x, y, z = MM * body.centre
    shapes = [
        (f"<pose>{_numbers(MM * centre)} 0 0 0</pose>", f"<box><size>{_numbers(MM * size)}</size></box>")
        for size, centre in body.boxes
    ] + [
        ("", f"<mesh><uri>{thing.name}_piece_{k}.obj</uri><drake:declare_convex/></mesh>")
        for k in range(len(body.hulls))
    ]
    collisions = "".join(
        f"""
      <collision name="piece_{k}">
        {pose}<geometry>{shape}</geometry>
        <drake:proximity_properties>
          <drake:mu_static>{thing.friction}</drake:mu_static>
          <drake:mu_dynamic>{thing.friction}</drake:mu_dynamic>
        </drake:proximity_properties>
      </collision>"""
        for k, (pose, shape) in enumerate(shapes)
    )
    pose = "\n    <pose>0 0 0 0 1.5707963268 0</pose>" if thing.lying else ""
    return f"""<?xml version="1.0"?>
<sdf version="1.9" xmlns:drake="http://drake.mit.edu">
  <model name="{thing.name}">{pose}
    <link name="{thing.name}">
      <inertial>
        <pose>{x:.6f} {y:.6f} {z:.6f} 0 0 0</pose>
        <mass>{thing.mass}</mass>
        <inertia>
          <ixx>{i[0, 0]:.6e}</ixx><iyy>{i[1, 1]:.6e}</iyy><izz>{i[2, 2]:.6e}</izz>
          <ixy>{i[0, 1]:.6e}</ixy><ixz>{i[0, 2]:.6e}</ixz><iyz>{i[1, 2]:.6e}</iyz>
        </inertia>
      </inertial>
      <visual name="visual">
        <geometry><mesh><uri>{thing.name}.gltf</uri></mesh></geometry>
      </visual>{collisions}
    </link>
  </model>
</sdf>
"""


def _numbers(vector: NDArray) -> str:
    return " ".join(f"{value:.5f}" for value in vector)


def main() -> None:
    """Command line: make every thing."""
    parser = argparse.ArgumentParser(description="Make the household things: surfaces, textures, SDF.")
    parser.add_argument("output", nargs="?", type=Path, default=Path(__file__).parent)
    output = parser.parse_args().output
    for thing in THINGS:
        make_thing(thing, output / thing.name)


if __name__ == "__main__":
    main()
