"""`riseg bench --view`: what the live view in the browser costs the segmentation."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat, MeshcatVisualizerParams
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource
from rich.console import Console

from riseg_drake.app.bench.recorded_push import StationOutputs, put_through
from riseg_drake.app.diagram import stage_of
from riseg_drake.app.meshcat_replay import replay
from riseg_drake.app.meshcat_view import MeshcatView
from riseg_drake.app.output_folder import to_json, write_told
from riseg_drake.app.scenario import Scenario
from riseg_drake.app.segmentation_block import add_segmentation
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.stations.arm_view import add_arm_view

ROUNDS = 5
"""How often the push is gone through, with and without the view."""
MOST = 0.10
"""Of a frame's time, what the view may cost."""


def bench_view(
    scenario: Scenario, images: Sequence[StationOutputs], json_file: Path | None, console: Console
) -> None:
    """Put a push through Alg. 2 with and without the view, frame by frame in turn, and say what it costs.

    The figures go to `json_file`, too, if one is named.
    """
    rounds = []
    with TemporaryDirectory() as folder:
        for number in range(ROUNDS):
            meshcat = Meshcat()
            with replay(meshcat, Path(folder) / "replay.html"):
                rounds.append(frame_times(scenario, images, meshcat, number % 2))
    figures = costs(np.array(rounds))
    words = "good" if figures["share"] <= MOST else "NOT good enough"
    console.print(
        f"a frame takes {figures['without_ms']:.1f} ms without the view, {figures['with_ms']:.1f} ms with it: "
        f"{100 * figures['share']:+.1f} % ({len(images) - 1} frames, the least of {ROUNDS} rounds of each; "
        f"the frame that it costs most {figures['most_ms']:.1f} ms more), {words}; "
        "where it is not asked for there is none"
    )
    if json_file is not None:
        write_told(json_file, to_json(figures).encode())


def frame_times(
    scenario: Scenario, images: Sequence[StationOutputs], meshcat: Meshcat, first: int = 0
) -> NDArray[np.float64]:
    """What every frame but the first takes, s [N, 2]: without and with the view, in turn on each frame.

    `first` is which of both begins with the first frame; then they change.
    """
    period = 1 / scenario.station.camera.rate
    both = [put_through(_segmentation(scenario, each), images, period) for each in (None, meshcat)]
    for each in both:
        next(each)  # fills what is computed once for all
    times = np.empty((len(images) - 1, 2))
    for frame in range(len(times)):
        for which in ((first + frame) % 2, (first + frame + 1) % 2):
            start = perf_counter()
            next(both[which])
            times[frame, which] = perf_counter() - start
    return times


def costs(rounds: NDArray[np.float64]) -> dict[str, float]:
    """Means over the frames of rounds of `frame_times` [R, N, 2], ms, and the view's share of a frame's time.

    Of each frame the least of all rounds counts: what else a machine does only adds to it.
    """
    least = rounds.min(axis=0)
    without, beside = least.mean(axis=0)
    return {
        "without_ms": 1e3 * float(without),
        "with_ms": 1e3 * float(beside),
        "share": float(beside / without - 1),
        "most_ms": 1e3 * float((least[:, 1] - least[:, 0]).max()),
    }


def _segmentation(scenario: Scenario, meshcat: Meshcat | None) -> Diagram:
    """Alg. 2, and where there is a server the view with the arm, as `riseg hardware --meshcat` wires them."""
    config = scenario.station
    kinematics = PandaKinematics(config.panda, config.camera.fixed_pose)
    builder = DiagramBuilder()
    block = add_segmentation(builder, scenario, kinematics, seed=0)
    for name, port in block.inputs.items():
        builder.ExportInput(port, name)
    if meshcat is not None:
        view = builder.AddSystem(
            MeshcatView(meshcat, 1 / config.camera.rate, stage_of(scenario, kinematics.tool))
        )
        for name in ("pair", "segmentation"):
            builder.Connect(block.outputs[name], view.GetInputPort(name))
        for name, value in (("active_push", NO_PUSH), ("interaction_step", 0), ("phase", ArmPhase.PUSH)):
            source = builder.AddSystem(ConstantValueSource(AbstractValue.Make(value)))
            builder.Connect(source.get_output_port(), view.GetInputPort(name))
        fixed_camera = kinematics.fixed_camera
        angles = add_arm_view(builder, config.panda, fixed_camera, meshcat, MeshcatVisualizerParams())
        builder.ConnectInput("position", angles)
    return builder.Build()
