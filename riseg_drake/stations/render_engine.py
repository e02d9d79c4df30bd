"""The renderer of every simulated picture: Drake's VTK engine, kept from a trap of Mesa's software renderer."""

import os

from pydrake.geometry import MakeRenderEngineVtk, RenderEngine, RenderEngineVtkParams

EXTENSIONS = "MESA_EXTENSION_OVERRIDE"
"""Environment variable by which Mesa is told what it is to go without."""
WITHOUT_ANISOTROPY = "-GL_EXT_texture_filter_anisotropic -GL_ARB_texture_filter_anisotropic"


def make_render_engine(parameters: RenderEngineVtkParams) -> RenderEngine:
    """A render engine as `MakeRenderEngineVtk` makes it, whose textures Mesa filters alike in all directions.

    Filtered anisotropically, as VTK asks, a textured triangle that is seen from its edge makes llvmpipe (Mesa
    22.3) add up texels over a footprint of millions of them: one picture took a quarter of an hour. Without,
    a picture also takes a fifth less. The variable goes into the environment of this process, unless it
    stands there, and counts from the first picture on; other drivers do not read it.
    """
    os.environ.setdefault(EXTENSIONS, WITHOUT_ANISOTROPY)
    return MakeRenderEngineVtk(parameters)
