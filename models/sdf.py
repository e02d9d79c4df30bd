"""What the programs that make models share: the SDF of one rigid body, fresh folders, a command line."""

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Protocol, TypeVar

from numpy.typing import NDArray


class Named(Protocol):
    """A recipe; its name is that of the folder, the files and the body."""

    @property
    def name(self) -> str: ...  # noqa: D102


Recipe = TypeVar("Recipe", bound=Named)


def fresh_folder(folder: Path, name: str) -> None:
    """Make a folder if need be, and remove from it what an earlier run called after the body."""
    folder.mkdir(parents=True, exist_ok=True)
    for stale in folder.glob(f"{name}*"):
        stale.unlink()


def collision(name: str, shape: str, friction: float, stiffness: str = "") -> str:
    """One collision shape: its pose, if any, and geometry; how it is touched beside friction, lines of SDF."""
    return f"""
      <collision name="{name}">
        {shape}
        <drake:proximity_properties>{stiffness}
          <drake:mu_static>{friction}</drake:mu_static>
          <drake:mu_dynamic>{friction}</drake:mu_dynamic>
        </drake:proximity_properties>
      </collision>"""


def convex_mesh(file: str) -> str:
    """The geometry of a convex piece."""
    return f"<geometry><mesh><uri>{file}</uri><drake:declare_convex/></mesh></geometry>"


def sdf(
    name: str,
    mass: str,
    centre: NDArray,
    inertia: NDArray,
    visual: str,
    collisions: Iterable[str],
    pose: str = "",
) -> str:
    """The SDF of a body of that name.

    Args:
        name: of model and link.
        mass: in kg, as it is to be written.
        centre: of mass [3], m.
        inertia: about it [3, 3], kg m^2.
        visual: file of the mesh that is seen.
        collisions: what `collision` made.
        pose: of the model, `x y z roll pitch yaw` in m and rad; empty where it stands as it was made.
    """
    x, y, z = centre
    i = inertia
    placed = f"\n    <pose>{pose}</pose>" if pose else ""
    return f"""<?xml version="1.0"?>
<sdf version="1.9" xmlns:drake="http://drake.mit.edu">
  <model name="{name}">{placed}
    <link name="{name}">
      <inertial>
        <pose>{x:.6f} {y:.6f} {z:.6f} 0 0 0</pose>
        <mass>{mass}</mass>
        <inertia>
          <ixx>{i[0, 0]:.6e}</ixx><iyy>{i[1, 1]:.6e}</iyy><izz>{i[2, 2]:.6e}</izz>
          <ixy>{i[0, 1]:.6e}</ixy><ixz>{i[0, 2]:.6e}</ixz><iyz>{i[1, 2]:.6e}</iyz>
        </inertia>
      </inertial>
      <visual name="visual">
        <geometry><mesh><uri>{visual}</uri></mesh></geometry>
      </visual>{"".join(collisions)}
    </link>
  </model>
</sdf>
"""


def make_all(
    recipes: Iterable[Recipe], make: Callable[[Recipe, Path], None], beside: Path, description: str
) -> None:
    """Command line: make everything, in a folder each; where no output is named, beside the program."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("output", nargs="?", type=Path, default=beside)
    output = parser.parse_args().output
    for recipe in recipes:
        make(recipe, output / recipe.name)
