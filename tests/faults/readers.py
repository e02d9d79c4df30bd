"""Everything that reads what somebody else made: a right input, what is done to it, and how it is read."""

import json
import random
import shutil
from dataclasses import asdict
from pathlib import Path

import cv2
import numpy as np

from riseg_drake.app.cli import main
from riseg_drake.app.evaluate.command import scene_tasks
from riseg_drake.app.evaluate.scene_folder import is_finished, read_result
from riseg_drake.app.output_folder import OutputFolder
from riseg_drake.app.scenario import Scenario, load_scenario
from riseg_drake.app.segment.recorded_view import recorded_view
from riseg_drake.evaluation.disturbance import ObjectMotion
from riseg_drake.evaluation.report import report_text
from riseg_drake.evaluation.scores import score
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.stations.lcm_images import decode_images, decode_message, encode_images
from riseg_drake.stations.object_models import find_models
from tests.faults.mutations import mutated, resized_jpeg, resized_png
from tests.faults.reader import Reader, all_files, as_command, some
from tests.faults.sources import SOURCES, SOURCES_NEED, state_of
from tests.recording.made_recordings import drawn_frames, write

CAMERA = Intrinsics(64, 48, 61.6, 61.6, 31.2, 23.4)
BOX = """<robot name="box"><link name="box">
<inertial><mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
<visual><geometry><box size="0.1 0.1 0.05"/></geometry></visual>
<collision><origin xyz="0 0 0.01" rpy="0 0 0.1"/><geometry><box size="0.1 0.1 0.05"/></geometry></collision>
</link></robot>
"""
BALL = """<?xml version="1.0"?><sdf version="1.7"><model name="ball"><link name="ball">
<pose>0 0 0.1 0 0 0</pose>
<inertial><mass>0.1</mass><inertia><ixx>1e-4</ixx><iyy>1e-4</iyy>
<izz>1e-4</izz></inertia></inertial>
<collision name="c"><geometry><sphere><radius>0.03</radius></sphere></geometry></collision>
<visual name="v"><geometry><cylinder><radius>0.03</radius><length>0.02</length></cylinder></geometry></visual>
</link></model></sdf>
"""
GANTRY = """<robot name="gantry"><link name="base"/><link name="hand"><visual><origin xyz="0 -0.1 0.1"/>
<geometry><box size="0.02 0.02 0.02"/></geometry></visual></link>
<joint name="x" type="prismatic"><parent link="base"/><child link="hand"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<link name="camera"/><joint name="mount" type="fixed"><parent link="hand"/><child link="camera"/>
<origin xyz="0 0 0.45" rpy="3.14159265 0 0"/></joint></robot>"""


def _recording(place: Path) -> None:
    folder = write(place / "recording", drawn_frames(4, CAMERA), CAMERA)
    (folder / "run.json").write_text('{"seed": 3}\n')
    (folder / "scenario.yaml").write_text("segment:\n  evidence: {memory: true}\nlongest: 30.0\n")
    (folder / "robot").mkdir()
    for k in range(4):
        cv2.imwrite(str(folder / "robot" / f"00000{k}.png"), np.zeros(CAMERA.shape, np.uint8))
    jpeg = folder / "rgb" / "000002.png"
    cv2.imwrite(str(jpeg.with_suffix(".jpg")), cv2.imread(str(jpeg)))
    jpeg.unlink()
    (folder / "rgb.txt").write_text((folder / "rgb.txt").read_text().replace("000002.png", "000002.jpg"))
    (place / "elsewhere").write_text("0 0 0 0 0 0 0 1\n")


def _recording_files(place: Path) -> list[Path]:
    """Lists and settings as often as images."""
    files = [path for path in (place / "recording").rglob("*") if not path.is_dir()]
    return files + 4 * [path for path in files if path.suffix not in (".png", ".jpg")]


def _segment(place: Path) -> int:
    output = place / "out"
    before = state_of(place / "recording")
    code = main(["segment", str(place / "recording"), "--output", str(output)])
    assert state_of(place / "recording") == before, "the recording was changed"
    assert {path.name for path in place.iterdir()} <= {"recording", "elsewhere", "out"}, "stray files"
    if code == 0:
        assert json.loads((output / "summary.json").read_text())["state"] == "done"
        for mask in (output / "mask").glob("*"):
            assert cv2.imread(str(mask), cv2.IMREAD_UNCHANGED).dtype == np.uint16
    return code


def _models(place: Path) -> None:
    (place / "models").mkdir()
    (place / "models" / "box.urdf").write_text(BOX)
    (place / "models" / "ball.sdf").write_text(BALL)


def _robot(place: Path) -> None:
    frames = drawn_frames(1, CAMERA)
    write(place / "recording", frames, CAMERA)
    (place / "recording" / "joints.csv").write_text("timestamp,x\n0,0\n")
    (place / "gantry.urdf").write_text(GANTRY)


def _view(place: Path) -> None:
    reader = RecordingReader(place / "recording")
    recorded_view(reader, Scenario(), place / "gantry.urdf", "camera")


def _scenarios(place: Path) -> None:
    for name in ("simulation", "hardware"):
        built_in = Path(__file__).parents[2] / "diagrams" / f"{name}.yaml"
        lines = [line for line in built_in.read_text().splitlines() if line.strip() and line.strip()[0] != "#"]
        (place / f"{name}.yaml").write_text("\n".join(lines) + "\n")


def _load_scenarios(place: Path) -> None:
    for path in sorted(place.glob("*.yaml")):
        load_scenario(path)


def _masks(place: Path) -> None:
    labels = np.zeros((48, 64), np.uint16)
    labels[10:30, 10:40] = 3
    for name in ("predicted", "true"):
        (place / name).mkdir()
        for k in range(2):
            cv2.imwrite(str(place / name / f"{k}.png"), labels)


def _pictures(place: Path) -> None:
    rng = np.random.default_rng(0)
    color = rng.integers(0, 255, (48, 64, 3), np.uint8)
    depth = np.full((48, 64), 0.5, np.float32)
    message = encode_images(color, depth, 1.0, 1.1, 3, raw_depth=depth, infrared={"infrared": color[..., 0]})
    (place / "message.lcm").write_bytes(message.encode())


def _change_picture(place: Path, rng: random.Random) -> str:
    """Either bytes of the message, or what it says, or the images in it are changed."""
    path = place / "message.lcm"
    message = decode_message(path.read_bytes())
    image = rng.choice(message.images)
    how = rng.randrange(4)
    if how == 0:
        path.write_bytes(mutated(path.read_bytes(), rng))
        return "bytes"
    if how == 1:
        if rng.random() < 0.5:
            field, values = (
                rng.choice(("width", "height", "row_stride")),
                (-1, 0, 1, 47, 49, 6000, 60000, 2**31 - 1),
            )
        else:
            field, values = rng.choice(("pixel_format", "channel_type", "compression_method")), range(-1, 12)
        setattr(image, field, rng.choice(values))
    elif how == 2:
        image.data = mutated(bytes(image.data), rng)
    else:
        change = resized_png if image.data[:4] == b"\x89PNG" else resized_jpeg
        image.data = change(bytes(image.data), rng)
        if rng.random() < 0.3:
            image.width = image.height = 60000
    image.size = len(image.data)
    path.write_bytes(message.encode())
    return f"{image.header.frame_name} {how}"


def _decode(place: Path) -> None:
    for size in (None, (64, 48)):
        decode_images(decode_message((place / "message.lcm").read_bytes()), size)


def _checkpoint(place: Path) -> None:
    import torch

    tensors = {"fnet.conv1.weight": torch.zeros(32, 3, 7, 7), "fnet.conv1.bias": torch.zeros(32)}
    torch.save(tensors, place / "raft.pth")
    torch.save(tensors, place / "old.pth", _use_new_zipfile_serialization=False)


def _load_checkpoints(place: Path) -> None:
    from riseg_drake.learned.raft_checkpoint import read_checkpoint

    for path in sorted(place.glob("*.pth")):
        read_checkpoint(path)


def _sam(place: Path) -> None:
    from tests.learned.tiny_sam import tiny_sam

    tiny_sam().save_pretrained(place / "sam")


def _load_sam(place: Path) -> None:
    from riseg_drake.learned.sam import load_sam

    load_sam(place / "sam")


def _results(place: Path) -> None:
    with OutputFolder(place / "run", "run", r"step_\d+", {"state": "done"}):
        (place / "run" / "step_0").mkdir()
    task = scene_tasks(Scenario(), "simulation", place / "evaluation", 1, 0, ablation=True)[0]
    task.folder.mkdir(parents=True)
    figures = score(np.eye(4, dtype=int), np.eye(4, dtype=int)).as_dict()
    motion = asdict(ObjectMotion(moved_m=0.01, tilted_deg=0.0))
    steps = [
        {"step": i, "scores": figures, "pushed": "a", "motions": {"a": motion}, "time_s": i} for i in (0, 1)
    ]
    for step in steps:
        step["in_motion"] = {"frames": 3, "overlap_f": 0.5, "at_rest_f": None}
    summary = {"command": "run", **task.settings, "state": "done", "end": "x", "steps": steps}
    summary |= {"ended": "no_path", "unsettled_area_m2": 0.002}
    (task.folder / "summary.json").write_text(json.dumps(summary))
    (task.folder / "baselines.json").write_text(json.dumps({name: [figures] * 2 for name in task.baselines}))
    (task.folder / "ablation.json").write_text(json.dumps({"scores": {}, "failures": {}}))


def _read_results(place: Path) -> None:
    task = scene_tasks(Scenario(), "simulation", place / "evaluation", 1, 0, ablation=True)[0]
    is_finished(task)
    report_text([read_result(task)], {}, last_step=1)
    OutputFolder(place / "run", "run", r"step_\d+", {}, overwrite=True).close()


NEEDS = {"checkpoints": "torch", "SAM folders": "transformers", **SOURCES_NEED}
"""What may not be installed; those readers are left out then."""
READERS = {
    "recordings": Reader(_recording, some(_recording_files), _segment),
    "scenarios": Reader(_scenarios, some(all_files), as_command(_load_scenarios)),
    "models": Reader(_models, some(all_files), as_command(lambda p: find_models(str(p / "models")))),
    "robots": Reader(_robot, some(lambda p: [p / "gantry.urdf"]), as_command(_view)),
    "masks": Reader(_masks, some(all_files), lambda p: main(["score", str(p / "predicted"), str(p / "true")])),
    "pictures over LCM": Reader(_pictures, _change_picture, as_command(_decode)),
    "checkpoints": Reader(_checkpoint, some(all_files), as_command(_load_checkpoints)),
    "SAM folders": Reader(_sam, some(all_files), as_command(_load_sam)),
    "earlier results": Reader(_results, some(all_files), as_command(_read_results)),
    **SOURCES,
}
"""By what they read."""
SHARES = {"recordings": 4, "scenarios": 3, "models": 3, "robots": 2, "masks": 3, "pictures over LCM": 4}
"""Of all inputs, how many parts each reader gets; one if it is not here."""


def prepared(reader: Reader, place: Path) -> None:
    """A new folder with a right input."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    reader.prepare(place)
