"""Make the household things: for each a surface with a texture and a gloss, convex collision shapes, an SDF.

    python -m riseg_drake.models.household.make_household [OUTPUT]

writes one folder a thing; without OUTPUT, beside this file. The same program writes the same pictures again.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from riseg_drake.models.household.bodies import Body
from riseg_drake.models.household.gltf import gltf_text
from riseg_drake.models.household.things import THINGS, Thing
from riseg_drake.models.objects.texture import MM, plain_obj, write_png
from riseg_drake.models.sdf import collision, convex_mesh, fresh_folder, make_all, sdf


def make_thing(thing: Thing, folder: Path) -> None:
    """Write one thing's files into `folder`, which is made if need be."""
    fresh_folder(folder, thing.name)
    body = thing.make(np.random.default_rng(sum(thing.name.encode())))
    write_png(folder / f"{thing.name}.png", body.texture)
    text = gltf_text(body.surface, f"{thing.name}.png", thing.roughness, thing.metallic)
    (folder / f"{thing.name}.gltf").write_text(text)
    for k, (vertices, faces) in enumerate(body.hulls):
        (folder / f"{thing.name}_piece_{k}.obj").write_text(plain_obj(vertices, faces))
    (folder / f"{thing.name}.sdf").write_text(_sdf(thing, body))


def _sdf(thing: Thing, body: Body) -> str:
    density = thing.mass / body.volume  # kg/mm^3
    shapes = [
        f"<pose>{_numbers(MM * centre)} 0 0 0</pose>"
        f"<geometry><box><size>{_numbers(MM * size)}</size></box></geometry>"
        for size, centre in body.boxes
    ] + [convex_mesh(f"{thing.name}_piece_{k}.obj") for k in range(len(body.hulls))]
    return sdf(
        thing.name,
        mass=str(thing.mass),
        centre=MM * body.centre,
        inertia=density * MM**2 * body.inertia,
        visual=f"{thing.name}.gltf",
        collisions=[collision(f"piece_{k}", shape, thing.friction) for k, shape in enumerate(shapes)],
        pose="0 0 0 0 1.5707963268 0" if thing.lying else "",
    )


def _numbers(vector: NDArray) -> str:
    return " ".join(f"{value:.5f}" for value in vector)


def main() -> None:
    """Command line: make every thing."""
    make_all(THINGS, make_thing, Path(__file__).parent, "Make the household things: surfaces, textures, SDF.")


if __name__ == "__main__":
    main()
