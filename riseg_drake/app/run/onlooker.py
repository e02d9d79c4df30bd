"""Somebody who stands beside the simulated robot and watches: pictures for people, not for the algorithm."""

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    LightParameter,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context
from pydrake.systems.sensors import CameraInfo

from riseg_drake.stations.filmed_world import looking_at
from riseg_drake.stations.render_engine import make_render_engine
from riseg_drake.stations.simulated import CLIPPING, SimulatedStation

RENDERER = "onlooker"
EYE_W = (1.04, -0.64, 0.64)
"""Where the onlooker's eye is, m,"""
TARGET_W = (0.45, -0.01, 0.15)
"""and where it looks."""
FIELD_OF_VIEW = 0.60
"""Vertical, rad."""


class Onlooker:
    """Renders a simulated station from beside, with light and shadow of its own.

    Meshcat shows the same in a browser; this needs none. Make it before the station's first context: that
    context is to know its renderer.
    """

    def __init__(self, station: SimulatedStation, width: int, height: int):
        """Pictures of so many pixels."""
        self._scene_graph = station.scene_graph
        self._scene_graph.AddRenderer(RENDERER, make_render_engine(_light()))
        info = CameraInfo(width, height, FIELD_OF_VIEW)
        core = RenderCameraCore(RENDERER, info, ClippingRange(*CLIPPING), RigidTransform())
        self._camera = ColorRenderCamera(core)
        self._X_WC = looking_at(np.array(EYE_W), np.array(TARGET_W))

    def look(self, context: Context) -> NDArray[np.uint8]:
        """The picture [height, width, 3] of the moment of a diagram's context that holds the station."""
        here = self._scene_graph.GetMyContextFromRoot(context)
        query = self._scene_graph.get_query_output_port().Eval(here)
        world = self._scene_graph.world_frame_id()
        return query.RenderColorImage(self._camera, world, self._X_WC).data[..., :3].copy()


def _light() -> RenderEngineVtkParams:
    """Two lights from above, so that no shadow is black; one from the eye, whose shadows nobody sees."""
    return RenderEngineVtkParams(
        lights=[
            LightParameter(type="directional", frame="world", direction=[-0.25, 0.35, -1.0], intensity=0.38),
            LightParameter(type="directional", frame="world", direction=[-0.1, 0.2, -1.0], intensity=0.34),
            LightParameter(type="directional", frame="camera", direction=[0.0, 0.0, 1.0], intensity=0.48),
        ],
        default_clear_color=[0.94, 0.95, 0.96],
        cast_shadows=True,
        shadow_map_size=2048,
    )
