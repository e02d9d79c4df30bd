"""docs/troubleshooting.md: every message that it quotes is provoked, and what it says of causes is tried."""

import ctypes
import errno
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drake import lcmt_image_array, lcmt_panda_status

from riseg_drake.app.cli import main
from riseg_drake.app.hardware.drivers import PATIENCE, HardwareError, wait_for_drivers
from riseg_drake.app.output import RunFolder
from riseg_drake.app.scenario import HARDWARE, Scenario, load_scenario
from riseg_drake.app.segment.replay import Replay
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.segmentation.above_table import AboveTableParameters, objects_above_table
from riseg_drake.stations import lcm_channels
from riseg_drake.stations.lcm_images import decode_images, encode_images
from riseg_drake.systems.frame_view import FrameView
from tests.app.hardware.test_hardware import Drivers
from tests.docs.pages import CHECKOUT, blocks
from tests.recording.made_recordings import drawn_frames, write
from tests.segmentation.drawn_scene import CAMERA, DrawnScene, looking_down, planar

PAGE = CHECKOUT / "docs" / "troubleshooting.md"
QUOTED = [" ".join(block.text.split()) for block in blocks(PAGE, "text")]


class NothingComes:
    """A connection on which nobody speaks."""

    statuses = pictures = 0
    status = None

    def untold(self):
        return []


def without_egl(patch):
    def missing(name):
        raise OSError(name)

    patch.setattr(ctypes, "CDLL", missing)
    main(["run"])


def small_buffer(patch):
    Path("rmem_max").write_text("212992\n")
    print(lcm_channels.receive_buffer_warning(lcm_channels.LcmConfig.url, Path("rmem_max")))


def url_without_a_buffer(patch):
    Path("rmem_max").write_text("212992\n")
    print(lcm_channels.receive_buffer_warning("udpm://239.255.76.67:7667?ttl=1", Path("rmem_max")))


def no_drivers(patch):
    def at_once(chosen, console):
        try:
            wait_for_drivers(NothingComes(), load_scenario(None, HARDWARE).hardware, patience=0.0)
        except HardwareError as error:
            raise HardwareError(str(error).replace("within 0 s", f"within {PATIENCE:g} s")) from None

    patch.setattr("riseg_drake.app.commands.hardware", at_once)
    main(["hardware"])


def depth_as_the_infrared_camera_sees_it(patch):
    def decode(chosen, console):
        color, depth = np.zeros((8, 8, 3), np.uint8), np.ones((8, 8), np.float32)
        sent: lcmt_image_array = encode_images(color, None, 0.0, 0.0, 0, raw_depth=depth)
        decode_images(sent)

    patch.setattr("riseg_drake.app.commands.hardware", decode)
    main(["hardware"])


def user_stop(patch):
    drivers = Drivers()
    drivers.speak(lcmt_panda_status.kUserStopped)
    drivers.show()

    def at_once(chosen, console):
        try:
            wait_for_drivers(drivers.reception, drivers.config, patience=0.0, ready=True)
        except HardwareError as error:
            raise HardwareError(str(error).replace("within 0 s", f"within {PATIENCE:g} s")) from None

    patch.setattr("riseg_drake.app.commands.hardware", at_once)
    main(["hardware"])


def a_clock_that_is_ahead(patch):
    drivers = Drivers()
    drivers.speak(stamp_off=7.0)
    print(*drivers.reception.untold())


def nothing_moves(patch):
    write(Path("my_recording"), drawn_frames(8, moves=False))
    main(["segment", "my_recording"])


def no_table(patch):
    frame, _ = DrawnScene([]).frame(0, looking_down(), [], np.random.default_rng(0))
    rough = np.random.default_rng(0).uniform(0.3, 3.0, frame.depth.shape).astype(np.float32)
    try:
        objects_above_table(replace(frame, depth=rough), AboveTableParameters())
    except ValueError as error:
        print(error)


def millimetres_taken_for_metres(patch):
    write(Path("my_recording"), drawn_frames(3))
    camera = json.loads(Path("my_recording/camera.json").read_text())
    Path("my_recording/camera.json").write_text(json.dumps({**camera, "depth_scale": 1}))
    main(["segment", "my_recording"])


def a_fifth_of_the_size(patch):
    write(Path("my_recording"), drawn_frames(3))
    camera = json.loads(Path("my_recording/camera.json").read_text())
    Path("my_recording/camera.json").write_text(json.dumps({**camera, "depth_scale": 5000}))
    main(["segment", "my_recording"])


def misspelt(patch):
    Path("scenario.yaml").write_text("sation: {}\n")
    main(["run", "scenario.yaml"])


def somebody_elses_folder(patch):
    Path("out").mkdir()
    Path("out/thesis.tex").write_text("mine")
    main(["run", "--output", "out"])


def earlier_run(patch):
    earlier = RunFolder(Path("out/first"), {})
    earlier.note(state="done")
    for number in (0, 1):
        Path(f"out/first/step_{number}").mkdir()
    earlier.close()
    main(["run", "--output", "out/first"])


def two_at_once(patch):
    patch.setattr("riseg_drake.app.output_folder.PATIENCE", 0.0)
    with RunFolder(Path("out/second"), {}):
        main(["run", "--output", "out/second"])


def full_output(patch):
    def full(chosen, console):
        raise OSError(errno.ENOSPC, "No space left on device")

    patch.setattr("riseg_drake.app.commands.score", full)
    main(["score", "a", "b"])


def link_to_elsewhere(patch):
    image = write(Path("my_recording"), drawn_frames(3)) / "rgb" / "000000.png"
    image.rename("elsewhere.png")
    image.symlink_to(Path("elsewhere.png").resolve())
    main(["segment", "my_recording"])


def without_dot(patch):
    patch.setattr(shutil, "which", lambda name: None)
    main(["diagram", "--output", "wiring.svg"])


PROVOKED = dict(
    zip(
        QUOTED,
        (
            without_egl,
            small_buffer,
            url_without_a_buffer,
            no_drivers,
            depth_as_the_infrared_camera_sees_it,
            user_stop,
            a_clock_that_is_ahead,
            nothing_moves,
            no_table,
            millimetres_taken_for_metres,
            a_fifth_of_the_size,
            misspelt,
            somebody_elses_folder,
            earlier_run,
            two_at_once,
            full_output,
            link_to_elsewhere,
            without_dot,
        ),
        strict=True,
    )
)
"""By the message, in the page's order."""

DRAWS = {somebody_elses_folder, earlier_run, two_at_once}
"""First asks whether images can be drawn."""


def without_shares(text):
    """How many percent of the points lie on the best plane is no matter here."""
    return re.sub(r"\b\d+%", "N%", text)


@pytest.mark.parametrize(
    ("quoted", "provoke"),
    [pytest.param(*each, marks=[pytest.mark.renders] * (each[1] in DRAWS)) for each in PROVOKED.items()],
    ids=[provoke.__name__ for provoke in PROVOKED.values()],
)
def test_a_message_is_what_the_program_says(quoted, provoke, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with monkeypatch.context() as patch:
        provoke(patch)
    said = capsys.readouterr()
    whole = " ".join((said.out + said.err).split())
    assert without_shares(quoted) in without_shares(whole)


SIDE = 0.06
BRICKS = [(SIDE, SIDE, 0.04), (SIDE, SIDE, 0.04)]


def film(pushed_by, frames, gap=0.0001, camera=looking_down, poses=True, scale=1.0):
    """Two bricks side by side; `pushed_by(k)` says by how much each is displaced along x at frame k, m."""
    scene, rng = DrawnScene(BRICKS), np.random.default_rng(0)
    replay = Replay(Scenario(), FrameView(CAMERA, None, None), seed=0)
    for k in range(frames):
        left, right = pushed_by(k)
        places = [planar(-SIDE / 2 + left, 0.0), planar(SIDE / 2 + gap + right, 0.0)]
        X_WC = camera(0.003 * k) if camera is not looking_down else looking_down()
        frame, _ = scene.frame(k, X_WC, places, rng)
        depth = (scale * frame.depth).astype(np.float32)
        replay.mask_after(RecordedFrame(k / 15, frame.color, depth, X_WC if poses else None))
    return replay.segmentation.object_ids


def moving_camera(x):
    return looking_down(x)


def rest(k):
    return 0.0, 0.0


def together(k):
    return 2 * (0.002 * max(0, min(k, 10) - 3),)


@pytest.mark.renders
def test_objects_that_touch_and_are_pushed_as_one_are_one_until_one_moves_alone():
    def one_later(k):
        left, right = together(k)
        return left, right + 0.002 * max(0, k - 20)

    assert film(together, frames=14) == (1,)
    assert film(one_later, frames=34) == (1, 2)
    assert film(together, frames=14, gap=0.02) == (1, 2)


@pytest.mark.renders
def test_a_camera_that_moves_untold_makes_objects_of_what_stands_still():
    assert film(rest, frames=12, camera=moving_camera, gap=0.02) == ()
    assert film(rest, frames=12, camera=moving_camera, gap=0.02, poses=False) == (1, 2)


@pytest.mark.renders
def test_a_wrong_depth_scale_matters_where_the_camera_moves():
    def one(k):
        return -0.002 * max(0, k - 3), 0.0

    assert film(one, frames=12, gap=0.02, scale=2.0) == (1,)
    assert film(rest, frames=12, gap=0.02, scale=2.0, camera=moving_camera) == (1, 2)
