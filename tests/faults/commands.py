"""The commands that are stopped at random moments: what each is given, and what must hold of what it leaves.

To try another one, add a `Stoppable` to `stoppables`; `beside` are commands that run as long as it does, such
as `riseg emulate` beside `riseg hardware`.
"""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import yaml

from riseg_drake.recording.layout import RecordingError
from riseg_drake.recording.reader import RecordingReader
from tests.recording.made_recordings import SMALL, drawn_frames, write

SCENARIO = """\
station:
  scene: {count_min: 1, count_max: 1}
  camera: {width: 160, height: 120, fx: 154.1, fy: 153.9, cx: 75.3, cy: 58.2, rate: 5}
arm: {most_interactions: 1}
"""
"""The smallest that has every phase of a run."""
EMULATED = """\
station: {{scene: {{count_min: 1, count_max: 1}}}}
emulator: {{lcm: {{url: "{url}"}}, driver: {{control_mode: velocity}}, rate: 5}}
"""
"""The same for the drivers; a camera's driver has pictures of one size."""
ROBOT = Path(__file__).parents[2] / "diagrams" / "hardware.yaml"
FRAMES = 60
STATES = {"running", "interrupted", "failed", "stopped", "done"}


@dataclass(frozen=True)
class Stoppable:
    """A command to be stopped."""

    name: str
    words: str
    """After `riseg`, without --output."""
    complaints: Callable[[Path, Path], list[str]]
    """What is wrong with an output folder, given that of an undisturbed command."""
    goes_on: bool = False
    """Whether the same command, given again, must bring it to the end."""
    beside: tuple[str, ...] = ()
    """Words of further commands that wait for Ctrl-C: begun before it, ended by the same signal after it."""


def stoppables(place: Path) -> dict[str, Stoppable]:
    """All of them, with what they need written to a folder."""
    place.mkdir(parents=True, exist_ok=True)
    scenario, recording = place / "scenario.yaml", place / "recording"
    scenario.write_text(SCENARIO)
    if not recording.exists():
        write(recording, drawn_frames(FRAMES), SMALL)
    (place / "short.yaml").write_text(f"{SCENARIO}longest: 3.0\n")
    evaluate = f"evaluate --scenario {place / 'short.yaml'} --seed 1 --scenes 3 --jobs 2"
    url = f"udpm://239.255.76.67:{20000 + os.getpid() % 20000}?ttl=0&recv_buf_size=4194304"
    (place / "emulated.yaml").write_text(EMULATED.format(url=url))
    robot = yaml.safe_load(ROBOT.read_text().replace("!HardwareStationConfig", ""))
    robot["station"]["lcm"]["url"] = url
    robot["station"]["camera"] |= {"width": 320, "rate": 5.0}
    robot["station"]["command"]["safety"]["image_age"] = 5.0  # on a busy machine the arm would pause for ever
    robot["arm"]["most_interactions"] = 1
    robot["longest"] = 24 * 3600.0
    (place / "robot.yaml").write_text(
        yaml.safe_dump(robot).replace("station:", "station: !HardwareStationConfig")
    )
    emulate = f"emulate {place / 'emulated.yaml'} --seed 1"
    return {
        each.name: each
        for each in (
            Stoppable("run", f"run {scenario} --seed 1 --record", wrong_run),
            Stoppable("segment", f"segment {recording}", wrong_segmentation),
            Stoppable("evaluate", evaluate, wrong_evaluation, goes_on=True),
            Stoppable(
                "hardware", f"hardware {place / 'robot.yaml'} --yes --record", wrong_session, beside=(emulate,)
            ),
        )
    }


def wrong_run(folder: Path, right: Path) -> list[str]:
    """Listed steps are there, whole, and those of the undisturbed run; recorded frames are whole."""
    return _wrong_steps(folder, lambda name: _unequal_images(folder / name, right / name))


def wrong_session(folder: Path, right: Path) -> list[str]:
    """The same, but at wall time no session sees the pictures of another one."""
    return _wrong_steps(folder, lambda name: _unreadable_images(folder / name, right / "step_0"))


def wrong_segmentation(folder: Path, right: Path) -> list[str]:
    """Masks that are there are whole, and those of the undisturbed command; the summary counts no others."""
    summary, complaints = _summary(folder)
    if (folder / "mask").exists():
        complaints += _unequal_images(folder / "mask", right / "mask", all_there=summary.get("state") == "done")
    masks = len(list((folder / "mask").glob("[!.]*.png")))
    if summary.get("state") in ("done", "interrupted") and not 0 <= masks - summary["frames"] <= 1:
        complaints.append(f"{masks} masks are there, {summary['frames']} are in the summary")
    return complaints


def wrong_evaluation(folder: Path, right: Path) -> list[str]:
    """Every scene is a right run; of a finished evaluation all scenes, and the report, are there."""
    summary, complaints = _summary(folder)
    for scene in sorted(folder.glob("scene_*")):
        complaints += wrong_run(scene, right / scene.name)
    if summary.get("state") == "done":
        complaints += [
            f"{name} is not there" for name in ("report.md", "figure.png") if not (folder / name).exists()
        ]
        if [run["scores"] for run in summary["runs"]] != [run["scores"] for run in _summary(right)[0]["runs"]]:
            complaints.append("the scores are others")
    return complaints


def _summary(folder: Path) -> tuple[dict, list[str]]:
    """The summary, empty where there is none yet, and what is wrong with it."""
    path = folder / "summary.json"
    if not path.exists():
        return {}, [f"{entry.name} but no summary" for entry in folder.glob("[!.]*")]
    try:
        summary = json.loads(path.read_text())
    except ValueError as error:
        return {}, [f"{path}: {error}"]
    return summary, [] if summary.get("state") in STATES else [f"{path}: state {summary.get('state')}"]


def _wrong_steps(folder: Path, wrong_images: Callable[[str], list[str]]) -> list[str]:
    summary, complaints = _summary(folder)
    listed = [entry["step"] for entry in summary.get("steps", [])]
    if listed != list(range(len(listed))):
        complaints.append(f"the steps {listed} are listed")
    for i in listed:
        complaints += wrong_images(f"step_{i}")
    if (folder / "recording" / "rgb.txt").exists():
        complaints += _wrong_recording(folder / "recording")
    return complaints


def _unreadable_images(folder: Path, right: Path) -> list[str]:
    names = [path.name for path in sorted(right.glob("*.png"))]
    return [f"{folder / name} is no image" for name in names if cv2.imread(str(folder / name)) is None]


def _unequal_images(folder: Path, right: Path, all_there: bool = True) -> list[str]:
    complaints = []
    for wanted in sorted(right.glob("*.png")):
        path = folder / wanted.name
        if not path.exists():
            complaints += [f"{path} is missing"] * all_there
            continue
        image, other = (cv2.imread(str(p), cv2.IMREAD_UNCHANGED) for p in (path, wanted))
        if image is None or not np.array_equal(image, other):
            complaints.append(f"{path} is {'damaged' if image is None else 'another image'}")
    return complaints


def _wrong_recording(folder: Path) -> list[str]:
    if not (folder / "rgb.txt").read_text().strip().splitlines()[1:]:
        return []  # begun, no frame yet
    try:
        reader = RecordingReader(folder)
        frames = len(list(reader))
    except RecordingError as error:
        return [f"recording: {error}"]
    return [f"recording: {line}" for line in reader.left_out] + ([] if frames else ["recording: no frame"])
