"""How Rerun's viewer lays the time line out when it opens it."""

from typing import Any

TIME = "time"
"""The name of the one time line: s since the first frame."""


def blueprint() -> Any:
    """The scene in 3D beside the pictures, curves below them; a `rerun.blueprint.Blueprint`."""
    import rerun.blueprint as rrb

    pictures = rrb.Grid(
        rrb.Spatial2DView(
            name="colour and masks", origin="camera/image", contents=["$origin/color", "$origin/mask"]
        ),
        rrb.Spatial2DView(name="depth", origin="camera/image", contents=["$origin/depth"]),
        rrb.Spatial2DView(name="optical flow", origin="flow/optical"),
        rrb.Spatial2DView(name="expected flow", origin="flow/expected"),
    )
    curves = rrb.Tabs(
        rrb.TimeSeriesView(name="twists by group", origin="twists"),
        rrb.TimeSeriesView(name="confidence by id", origin="confidence"),
        rrb.TimeSeriesView(name="scores", origin="scores"),
        rrb.TimeSeriesView(name="time of each stage", origin="stages"),
    )
    scene = rrb.Spatial3DView(
        name="scene", origin="/", contents=["+ /**", "- /camera/image/mask", "- /flow/**"]
    )
    return rrb.Blueprint(
        rrb.Horizontal(scene, rrb.Vertical(pictures, curves, row_shares=[3, 2]), column_shares=[1, 1]),
        rrb.TimePanel(timeline=TIME, state="collapsed"),
    )
