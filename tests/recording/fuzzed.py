"""Recordings mutated as hypothesis says, and what must hold of each: masks or one line, no stray file."""

import contextlib
import io
import json
import shutil
from pathlib import Path

import cv2
import numpy as np
from hypothesis import HealthCheck
from hypothesis import strategies as st

from riseg_drake.app.cli import main
from riseg_drake.geometry.camera import Intrinsics

CAMERA = Intrinsics(64, 48, 61.6, 61.6, 31.2, 23.4)
TEXTS = ("rgb.txt", "depth.txt", "groundtruth.txt", "joints.csv", "camera.json", "run.json", "scenario.yaml")
FOLDERS = ("rgb", "depth", "label", "robot")
SETTINGS = {"deadline": None, "suppress_health_check": list(HealthCheck), "database": None, "derandomize": True}

cell = st.one_of(
    st.floats(width=32).map(repr),
    st.integers(-(10**20), 10**20).map(str),
    st.text(max_size=8),
    st.sampled_from(
        ["nan", "inf", "-0", "1e999", "../../x.png", "rgb/000001.png", "", "#", "timestamp", "\x00"]
    ),
)
cut = st.tuples(st.just("cut"), st.floats(0, 1))
flip = st.tuples(
    st.just("flip"), st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), min_size=1, max_size=9)
)
value = st.sampled_from(["noise", 0, 1, 500, 65535])
text_edit = st.one_of(
    cut,
    flip,
    st.tuples(st.just("cell"), st.tuples(st.integers(0, 9), st.integers(0, 8), cell)),
    st.tuples(st.just("drop"), st.integers(0, 9)),
    st.tuples(st.just("twice"), st.integers(0, 9)),
    st.tuples(st.just("swap"), st.integers(0, 9)),
    st.tuples(st.just("gone"), st.none()),
)
image_edit = st.one_of(
    cut,
    flip,
    st.tuples(st.just("gone"), st.none()),
    st.tuples(
        st.just("pixels"), st.tuples(st.integers(0, 2**31), st.sampled_from(["noise", 0, 1, 65535, 500]))
    ),
    st.tuples(st.just("shape"), st.tuples(st.integers(1, 70), st.integers(1, 70), st.sampled_from([8, 16]))),
)
edits = st.lists(
    st.one_of(
        st.tuples(st.sampled_from(TEXTS), text_edit),
        st.tuples(
            st.sampled_from(
                [f"{kind}/00000{k}.png" for kind in ("rgb", "depth", "label", "robot") for k in range(4)]
            ),
            image_edit,
        ),
    ),
    min_size=1,
    max_size=4,
)
camera = st.dictionaries(
    st.sampled_from(["width", "height", "fx", "fy", "cx", "cy", "depth_scale"]),
    st.one_of(
        st.floats(),
        st.integers(),
        st.text(max_size=3),
        st.none(),
        st.booleans(),
        st.floats(1, 1e4),
        st.just([]),
    ),
    max_size=2,
)


def mutate(path: Path, kind: str, how) -> None:
    path.parent.mkdir(exist_ok=True)
    if kind == "gone":
        path.unlink(missing_ok=True)
        return
    if kind in ("pixels", "shape"):
        bits = 16 if "rgb" not in str(path) else 8
        if kind == "shape":
            pixels = np.zeros(how[:2], f"uint{how[2]}")
        else:
            rng, shape = np.random.default_rng(how[0]), (*CAMERA.shape, 3)[: 3 if bits == 8 else 2]
            limit = 2**bits
            pixels = (
                rng.integers(0, limit, shape) if how[1] == "noise" else np.full(shape, min(how[1], limit - 1))
            )
            pixels = pixels.astype(f"uint{bits}")
        cv2.imwrite(str(path), pixels)
        return
    content = path.read_bytes() if path.exists() else b"0,0,0,0,0,0,0,0\n0.0666,0,0,0,0,0,0,1\n"
    if kind == "cut":
        content = content[: int(how * len(content))]
    elif kind == "flip":
        changed = bytearray(content or b"x")
        for where, value in how:
            changed[min(int(where * len(changed)), len(changed) - 1)] = value
        content = bytes(changed)
    else:
        lines = content.decode("utf-8", "replace").split("\n")
        row = (how[0] if kind == "cell" else how) % len(lines)
        if kind == "cell":
            separator = "," if "," in lines[row] else " "
            cells = lines[row].split(separator)
            cells[how[1] % len(cells)] = how[2]
            lines[row] = separator.join(cells)
        elif kind == "drop":
            del lines[row]
        elif kind == "twice":
            lines.insert(row, lines[row])
        else:
            lines[row], lines[row - 1] = lines[row - 1], lines[row]
        content = "\n".join(lines).encode("utf-8", "replace")
    path.write_bytes(content)


def check(whole: Path, work: Path, changes, camera_changes) -> None:
    shutil.rmtree(work, ignore_errors=True)
    recording, output = work / "recording", work / "out"
    shutil.copytree(whole, recording)
    for name, (kind, how) in changes:
        mutate(recording / name, kind, how)
    if camera_changes and (recording / "camera.json").exists():
        with contextlib.suppress(ValueError, TypeError):
            content = json.loads((recording / "camera.json").read_bytes())
            (recording / "camera.json").write_text(json.dumps({**content, **camera_changes}))
    before = {path: path.read_bytes() for path in recording.rglob("*") if path.is_file()}
    errors = io.StringIO()
    with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(io.StringIO()):
        code = main(["segment", str(recording), "--output", str(output)])
    assert code in (0, 2)
    assert errors.getvalue().count("\n") == (code == 2), errors.getvalue()
    assert {path: path.read_bytes() for path in recording.rglob("*") if path.is_file()} == before
    assert {path.name for path in work.iterdir()} <= {"recording", "out"}
    for mask in (output / "mask").glob("*"):
        image = cv2.imread(str(mask), cv2.IMREAD_UNCHANGED)
        assert image.dtype == np.uint16
        assert image.max() < 100
    assert code == 2 or json.loads((output / "summary.json").read_text())["state"] == "done"
