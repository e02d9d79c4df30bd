"""What the machine itself must have: images drawn, cores, real-time priority, a place for compiled kernels."""

import os
import threading
from pathlib import Path

import numpy as np
from pydrake.geometry import (
    Box,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    GeometryInstance,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    Rgba,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.sensors import CameraInfo

from riseg_drake.app.doctor.finding import Finding
from riseg_drake.app.graphics import NoGraphicsError, require_graphics
from riseg_drake.kernels.contraction import contract
from riseg_drake.stations.render_engine import make_render_engine

CORES = 2
"""One for the segmentation, one for the commands of a real arm beside it."""
DISTANCE = 1.0
"""Of the wall that is drawn to try it, m,"""
TOLERANCE = 0.001
"""and how exactly its depth must come out, m."""


def rendering() -> Finding:
    """Whether a wall is drawn where it stands."""
    about = "images are drawn (EGL)"
    try:
        require_graphics()
    except NoGraphicsError as error:
        return Finding(about, False, "no", str(error), is_needed=True)
    depth = _depth_of_a_wall()
    is_well = abs(depth - DISTANCE) < TOLERANCE
    says = f"a wall at {DISTANCE:g} m has a depth of {depth:.3f} m"
    remedy = "the graphics driver draws wrongly; try Mesa's own with LIBGL_ALWAYS_SOFTWARE=1"
    return Finding(about, is_well, says, "" if is_well else remedy, is_needed=True)


def _depth_of_a_wall() -> float:
    """What a depth camera sees in the middle of its image, m."""
    scene = SceneGraph()
    scene.AddRenderer("renderer", make_render_engine(RenderEngineVtkParams()))
    X_WP = RigidTransform(np.array([0.0, 0.0, DISTANCE + 0.05]))
    wall = GeometryInstance(X_WP, Box(2, 2, 0.1), "wall")
    look = PerceptionProperties()
    look.AddProperty("phong", "diffuse", Rgba(1, 1, 1, 1))
    look.AddProperty("label", "id", RenderLabel(1))
    wall.set_perception_properties(look)
    source = scene.RegisterSource("doctor")
    scene.RegisterAnchoredGeometry(source, wall)
    context = scene.CreateDefaultContext()
    core = RenderCameraCore("renderer", CameraInfo(16, 12, 1.0), ClippingRange(0.1, 10), RigidTransform())
    query = scene.get_query_output_port().Eval(context)
    camera = DepthRenderCamera(core, DepthRange(0.1, 5))
    seen = query.RenderDepthImage(camera, scene.world_frame_id(), RigidTransform()).data
    return float(seen[6, 8, 0])


def cores() -> Finding:
    """How many this process may use."""
    number = len(os.sched_getaffinity(0))
    is_well = number >= CORES
    remedy = "" if is_well else "enough to simulate; a real arm wants one for its commands alone"
    return Finding("cores", is_well, str(number), remedy)


def real_time_priority() -> Finding:
    """Whether the commands for a real arm may be sent before all else."""
    granted: list[bool] = []
    # A thread of its own: what it is granted ends with it.
    asking = threading.Thread(target=lambda: granted.append(_may_be_first()))
    asking.start()
    asking.join()
    remedy = "commands for a real arm may be late: allow `rtprio 20` in /etc/security/limits.conf, log in again"
    return Finding(
        "real-time priority",
        granted[0],
        "granted" if granted[0] else "not granted",
        "" if granted[0] else remedy,
    )


def _may_be_first() -> bool:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        return False
    return True


def kernel_cache() -> Finding:
    """Whether what numba compiles is kept for the next start."""
    place = contract.stats.cache_path  # type: ignore[attr-defined]
    is_well = place is not None and os.access(_nearest_folder(Path(place)), os.W_OK)
    remedy = "every start compiles for seconds: name a folder in NUMBA_CACHE_DIR that can be written"
    return Finding(
        "compiled kernels are kept",
        is_well,
        f"in {place}" if is_well else f"{place or 'no folder'} cannot be written",
        "" if is_well else remedy,
    )


def _nearest_folder(path: Path) -> Path:
    """The folder itself, or the first above it that is there."""
    return next(folder for folder in (path, *path.parents) if folder.is_dir())
