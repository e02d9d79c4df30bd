"""What `riseg segment` and `convert` are given beside folders of the own layout, and what they write."""

import json
import shutil
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from riseg_drake.app.cli import main
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.recording.reader import RecordingReader
from tests.faults.reader import Reader, all_files, some
from tests.recording.made_recordings import drawn_frames, write

CAMERA = Intrinsics(64, 48, 61.6, 61.6, 31.2, 23.4)
FORMATS = "coco,bop,npz,bundlesdf,clouds,poses"
ROBOT = """<robot name="gantry"><link name="base"><visual><geometry><mesh filename="package://gantry/base.obj"/>
</geometry></visual><collision><geometry><mesh filename="base.stl"/></geometry></collision></link>
<link name="hand"><visual><origin xyz="0 -0.1 0.1"/><geometry><cylinder radius="0.02" length="0.05"/></geometry>
</visual></link><joint name="x" type="prismatic"><parent link="base"/><child link="hand"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint><link name="camera"/>
<joint name="mount" type="fixed"><parent link="hand"/><child link="camera"/>
<origin xyz="0 0 0.45" rpy="3.14159265 0 0"/></joint></robot>"""
BASE = (
    "mtllib base.mtl\nusemtl gray\nv 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
)


def state_of(folder: Path) -> dict[str, int]:
    """When each file of a folder was changed, ns."""
    return {str(path): path.lstat().st_mtime_ns for path in folder.rglob("*")}


@cache
def _frames() -> list[RecordedFrame]:
    return drawn_frames(4, CAMERA)


def _bag(place: Path, **kind: object) -> None:
    from tests.recording.made_bags import BagKind, write_bag

    write_bag(place / "source", _frames(), CAMERA, BagKind(**kind))


@cache
def _bop_scene() -> TemporaryDirectory[str]:
    """A scene as `--export bop` leaves it; made once, and gone with the program."""
    folder = TemporaryDirectory(prefix="riseg_bop_")
    place = Path(folder.name)
    write(place / "recording", _frames(), CAMERA)
    assert main(["segment", str(place / "recording"), "--output", str(place / "out"), "--export", "bop"]) == 0
    return folder


def _bop(place: Path) -> None:
    made = Path(_bop_scene().name) / "out" / "export" / "bop" / "test" / "000000"
    shutil.copytree(made, place / "source")


def _folder(place: Path) -> None:
    """Without lists: numbers for names, colour as JPEG, depth as floats in metres."""
    for folder in ("color", "depth"):
        (place / "source" / folder).mkdir(parents=True)
    for k, frame in enumerate(_frames()):
        cv2.imwrite(str(place / "source" / "color" / f"frame_{k}.jpg"), frame.color[..., ::-1])
        np.save(place / "source" / "depth" / f"depth_{k}.npy", frame.depth)
    camera = {key: getattr(CAMERA, key) for key in ("width", "height", "fx", "fy", "cx", "cy")}
    depth = {**camera, "X_CD": [0, 0, 0, 0, 0, 0, 1]}
    content = {**camera, "depth_scale": 1, "distortion": [0.01, 0, 0, 0, 0], "depth": depth}
    (place / "source" / "camera.json").write_text(json.dumps(content))


def _recording(place: Path) -> None:
    write(place / "source", _frames(), CAMERA)


def _robot(place: Path) -> None:
    frames = [RecordedFrame(f.time, f.color, f.depth, None, position=np.zeros(1)) for f in _frames()]
    write(place / "source", frames, CAMERA)
    joints = place / "source" / "joints.csv"
    joints.write_text("\n".join(["timestamp,x", *joints.read_text().splitlines()[1:]]) + "\n")
    (place / "gantry").mkdir()
    (place / "gantry" / "gantry.urdf").write_text(ROBOT)
    (place / "gantry" / "base.obj").write_text(BASE)
    (place / "gantry" / "base.mtl").write_text("newmtl gray\nKd 0.5 0.5 0.5\nmap_Kd gray.png\n")
    cv2.imwrite(str(place / "gantry" / "gray.png"), np.full((8, 8, 3), 128, np.uint8))
    (place / "gantry" / "base.stl").write_bytes(b"solid that nobody reads")


def _robot_files(place: Path) -> list[Path]:
    """The robot's, and what its angles come from."""
    return [*(place / "gantry").iterdir(), place / "source" / "joints.csv"]


def _source(place: Path) -> Path:
    """The folder, or the one file, or the link that leads nowhere in its place."""
    return next(iter(sorted(place.glob("source*"))), place / "source")


def _segment(place: Path, *words: str) -> int:
    source, output = _source(place), place / "out"
    before = state_of(place)
    code = main(["segment", str(source), "--output", str(output), *words])
    assert {path: t for path, t in state_of(place).items() if path in before} == before, (
        "the source was changed"
    )
    if code == 0:
        assert json.loads((output / "summary.json").read_text())["state"] == "done"
        for mask in (output / "mask").glob("*"):
            assert cv2.imread(str(mask), cv2.IMREAD_UNCHANGED).dtype == np.uint16
    return code


def _with_rate(place: Path) -> int:
    return _segment(place, "--rate", "15")


def _export(place: Path) -> int:
    code = _segment(place, "--export", FORMATS)
    export = place / "out" / "export"
    for file in export.rglob("*.json"):
        json.loads(file.read_text())
    for file in export.rglob("*.npz"):
        with np.load(file, allow_pickle=False) as content:
            assert content["segmap"].shape == content["depth"].shape
    for file in export.rglob("*.png"):
        assert cv2.imread(str(file), cv2.IMREAD_UNCHANGED) is not None, file
    for file in (export / "poses").glob("*.txt"):
        assert np.loadtxt(file, ndmin=2).shape[1] == 8
    return code


def _convert(place: Path) -> int:
    code = main(["convert", str(_source(place)), str(place / "converted")])
    if code == 0:
        assert len(RecordingReader(place / "converted")) > 0
    return code


SOURCES = {
    "ROS 1 bags": Reader(partial(_bag, ros=1), some(all_files), _segment),
    "ROS 1 bags in chunks": Reader(partial(_bag, ros=1, chunks=True, depth="png"), some(all_files), _convert),
    "ROS 2 bags": Reader(partial(_bag, color="png", depth="32FC1"), some(all_files), _segment),
    "mcap": Reader(partial(_bag, storage="mcap", bare=True, poses="stamped"), some(all_files), _segment),
    "BOP scenes": Reader(_bop, some(all_files), _with_rate),
    "folders without lists": Reader(_folder, some(all_files), _with_rate),
    "exports": Reader(_recording, some(all_files), _export),
    "robots of recordings": Reader(
        _robot, some(_robot_files), lambda p: _segment(p, "--robot", str(p / "gantry" / "gantry.urdf"))
    ),
}
"""Ways in, by what they read."""
SOURCES_NEED = dict.fromkeys((name for name in SOURCES if "ROS" in name or name == "mcap"), "rosbags")
SOURCES_NEED["exports"] = "pycocotools"
"""What may not be installed; those readers are left out then."""
