"""`riseg calibrate` as a program: pictures of a board and joint angles in, the scenario's lines out."""

import json

import cv2
import numpy as np
import pytest
from PIL import Image
from pydrake.math import RigidTransform, RollPitchYaw
from rich.console import Console

from riseg_drake.app.cli import main
from riseg_drake.app.hardware import calibrate
from riseg_drake.app.hardware.board_views import record_views
from riseg_drake.app.hardware.calibrate import board_of, scenario_lines
from riseg_drake.app.scenario import HARDWARE, Scenario, load_scenario
from riseg_drake.app.scenario_file import parse_scenario
from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.geometry.se3 import exp_se3, inverse, log_se3, translation
from riseg_drake.recording import layout
from riseg_drake.recording.layout import RecordingError, pose_to_numbers
from riseg_drake.robot.calibration_board import CalibrationBoard
from riseg_drake.robot.camera_calibration import CalibrationError
from riseg_drake.robot.kinematics import PandaKinematics
from tests.robot.drawn_board import drawn_board

K = Intrinsics(640, 480, 616.285, 615.778, 317.0, 239.0)
BOARD = CalibrationBoard()
X_WB = translation(np.array([0.36, 0.1, 0.002])) @ exp_se3(np.array([3.13, 0.0, 0.0, 0, 0, 0]))


@pytest.fixture(scope="module")
def kinematics():
    return PandaKinematics()


@pytest.fixture(scope="module")
def X_EC(kinematics):
    """The camera is not quite where the model has it."""
    return kinematics.X_EC @ exp_se3(np.array([0.02, -0.015, 0.03, 0.004, -0.006, 0.003]))


def postures(kinematics, X_EC, count):
    """Joint angles [7] from which the camera sees the board, tilted to all sides."""
    rng, found = np.random.default_rng(0), []
    while len(found) < count:
        side, tilt = rng.uniform(0, 2 * np.pi), rng.uniform(0.15, 0.4)
        turn = np.array([tilt * np.cos(side), tilt * np.sin(side), rng.uniform(-0.5, 0.5), 0, 0, 0])
        middle = X_WB @ translation(np.array([0.14, 0.1, 0.0]))
        X_WC = middle @ exp_se3(turn) @ translation(np.array([0, 0, -0.42]))
        found.extend(kinematics.postures(X_WC @ inverse(X_EC))[:1])
    return found


def write_views(folder, kinematics, X_EC, count=10, tip=False):
    """A folder of views; returns it."""
    (folder / "rgb").mkdir(parents=True)
    (folder / "camera.json").write_text(json.dumps(layout.camera_to_json(K, 1000.0)))
    images, rows, rng = [], [], np.random.default_rng(1)
    for number, q in enumerate(postures(kinematics, X_EC, count)):
        X_WE = kinematics.X_WE(q)
        picture = drawn_board(BOARD, inverse(X_WE @ X_EC) @ X_WB, K, rng)
        cv2.imwrite(str(folder / f"rgb/{number}.png"), picture)
        images.append(f"{number}.0 rgb/{number}.png")
        numbers = pose_to_numbers(X_WE) if tip else q
        rows.append((" " if tip else ",").join(str(value) for value in (float(number), *numbers)))
    (folder / "rgb.txt").write_text("\n".join(images))
    heading = [] if tip else [layout.HEADERS[layout.JOINT_LIST]]
    (folder / ("tip.txt" if tip else "joints.csv")).write_text("\n".join([*heading, *rows]))
    return folder


@pytest.mark.renders
@pytest.mark.parametrize("tip", [False, True])
def test_the_lines_have_the_camera_within_a_millimetre_and_a_tenth_of_a_degree(
    tmp_path, kinematics, X_EC, tip, capsys
):
    folder = write_views(tmp_path / "views", kinematics, X_EC, tip=tip)
    lines = tmp_path / "lines.yaml"
    assert main(["calibrate", str(folder), "--output", str(lines)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    panda = parse_scenario(lines.read_text(), Scenario, "the lines").hardware.panda
    found = RigidTransform(RollPitchYaw(panda.X_EC[3:]), panda.X_EC[:3]).GetAsMatrix4()
    apart = inverse(X_EC) @ found
    assert np.linalg.norm(apart[:3, 3]) < 0.001
    assert np.degrees(np.linalg.norm(log_se3(apart)[:3])) < 0.1
    # The same words, as numbers: how sure, how far from the model (7.8 mm, 2.23 degrees), where the table is.
    assert "10 views of 10" in said
    assert "7.8 mm and 2.2" in said
    assert "the board lies 2." in said or "the board lies 1.9" in said
    assert "tilted by 0.6" in said
    np.testing.assert_allclose(PandaKinematics(panda).X_EC, found, atol=1e-9)


def test_the_lines_of_a_camera_in_the_world_are_those_of_its_mount():
    X_WC = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [1.0, 2.0, 0.5]).GetAsMatrix4()
    assert scenario_lines(X_WC, True) == (
        "station: !HardwareStationConfig\n  camera:\n    mount: world\n"
        "    X_WC: [1.000000, 2.000000, 0.500000, 0.100000, 0.200000, 0.300000]"
    )


def test_a_board_is_named_in_millimetres_and_drawn_at_its_size(tmp_path, capsys):
    assert board_of(["apriltag", "4x3", "50", "12.5"]) == CalibrationBoard("apriltag", 4, 3, 0.05, 0.0125)
    assert (
        main(["calibrate", "--draw", str(tmp_path / "board.png"), "--board", "charuco", "7x5", "25.4", "19"])
        == 0
    )
    assert "177.8 x 127.0 mm" in " ".join(capsys.readouterr().out.split())
    with Image.open(tmp_path / "board.png") as drawn:
        assert drawn.size == (2100, 1500)
        assert drawn.info["dpi"] == pytest.approx((300, 300), abs=0.02)  # PNG has whole pixels a metre


@pytest.mark.parametrize(
    ("mount", "words", "world"),
    [("wrist", [], False), ("world", [], True), ("world", ["--mount", "wrist"], False)],
)
def test_where_the_camera_is_mounted_is_the_scenario_s_unless_it_is_said(
    tmp_path, monkeypatch, kinematics, X_EC, mount, words, world
):
    scenario, asked = tmp_path / "mine.yaml", []
    X_WC = ", X_WC: [1.0, 0.0, 0.5, -2.3, 0.0, 1.5]" if mount == "world" else ""
    scenario.write_text(f"station: !HardwareStationConfig\n  camera: {{mount: {mount}{X_WC}}}\n")
    folder = write_views(tmp_path / "views", kinematics, X_EC, count=1)

    def solver(views, k, world):
        asked.append(world)
        raise CalibrationError("not needed here")

    monkeypatch.setattr(calibrate, "calibrated", solver)
    assert main(["calibrate", str(folder), "--scenario", str(scenario), *words]) == 2
    assert asked == [world]


@pytest.mark.parametrize(
    ("words", "right"),
    [
        ([], "name the folder with the views"),
        (["views", "--board", "charuco", "7by5", "40", "30"], "such as charuco 7x5 40 30"),
        (["views", "--board", "chess", "7x5", "40", "30"], "one of charuco, apriltag"),
        (["views"], "camera.json is missing"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, capsys, monkeypatch, words, right):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "views").mkdir()
    assert main(["calibrate", *words]) == 2
    said = capsys.readouterr().err.strip()
    assert right in said
    assert "\n" not in said


def test_views_without_the_arm_or_without_the_board_are_refused(tmp_path, capsys):
    folder = tmp_path / "views"
    (folder / "rgb").mkdir(parents=True)
    (folder / "camera.json").write_text(json.dumps(layout.camera_to_json(K, 1000.0)))
    (folder / "rgb.txt").write_text("0.0 rgb/0.png")
    cv2.imwrite(str(folder / "rgb/0.png"), np.full((480, 640, 3), 200, np.uint8))
    assert main(["calibrate", str(folder)]) == 2
    assert "needs joints.csv (timestamp,q1..q7) or tip.txt" in capsys.readouterr().err
    (folder / "joints.csv").write_text("timestamp,q1,q2,q3,q4,q5,q6,q7\n0.0,0,0,0,-1.5,0,1.5,0")
    assert main(["calibrate", str(folder)]) == 2
    assert "the board is seen in 0 views; at least 4 are wanted" in capsys.readouterr().err


def test_views_are_taken_where_the_arm_stands_and_the_board_is_seen(tmp_path, kinematics, X_EC, capsys):
    """The folder that it leaves is one that calibrate reads."""
    (q,) = postures(kinematics, X_EC, 1)
    board = drawn_board(BOARD, inverse(kinematics.X_WE(q) @ X_EC) @ X_WB, K, np.random.default_rng(0))
    blank = np.full_like(board, 150)
    looks = iter(
        [(1.0, board, q, 0.0), (2.0, board, q, 0.3), (3.0, blank, q, 0.0), (4.0, board, q + 0.1, 0.005)]
    )
    answers = iter([True] * 4 + [False])
    config = load_scenario(None, HARDWARE).hardware
    folder = tmp_path / "views"
    record_views(lambda: next(looks), lambda: next(answers), BOARD, folder, config, Console())
    said = " ".join(capsys.readouterr().out.split())
    assert "not taken: the arm moves by 0.30 rad/s not taken: 0 corners are seen view 2: 24 corners" in said
    assert (folder / "rgb.txt").read_text().splitlines()[1:] == ["1.0 rgb/000000.png", "4.0 rgb/000001.png"]
    rows = (folder / "joints.csv").read_text().splitlines()[1:]
    np.testing.assert_allclose(np.array(rows[1].split(","), float), [4.0, *(q + 0.1)])
    np.testing.assert_array_equal(cv2.imread(str(folder / "rgb/000000.png"))[..., ::-1], board)
    with pytest.raises(RecordingError, match="is not empty; give a new folder"):
        record_views(lambda: next(looks), lambda: False, BOARD, folder, config, Console())
