"""The recording of a run: every frame of its camera, and what else it takes to get the same masks from them."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pydrake.common.yaml import yaml_dump_typed
from pydrake.systems.framework import Context

from riseg_drake.app.diagram import WiredDiagram
from riseg_drake.app.output_folder import to_json
from riseg_drake.app.run.interactions import Listener, TruthSource
from riseg_drake.app.scenario import Scenario
from riseg_drake.geometry.rgbd import Frame
from riseg_drake.recording.layout import RUN_FILE, SCENARIO_FILE, RecordedFrame
from riseg_drake.recording.whole_file import write_text
from riseg_drake.recording.writer import RecordingWriter


@contextmanager
def recording_of(
    wired: WiredDiagram, scenario: Scenario, seed: int, truth: TruthSource, folder: Path
) -> Iterator[Listener]:
    """For the time of a `with`: what writes every frame to a folder, with true labels where they are known."""
    with RecordingWriter(folder, wired.intrinsics) as writer:
        write_text(folder / SCENARIO_FILE, yaml_dump_typed(scenario))
        write_text(folder / RUN_FILE, to_json({"seed": seed}))

        def record(frame: Frame, context: Context) -> None:
            known = truth(frame, context)
            writer.append(
                RecordedFrame(
                    time=frame.time,
                    color=frame.color,
                    depth=frame.depth,
                    X_WC=frame.X_WC,
                    position=wired.position(context),
                    robot=frame.robot,
                    labels=known.labels if known else None,
                )
            )

        yield record
