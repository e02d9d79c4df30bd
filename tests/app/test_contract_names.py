"""The names that people and programs rely on: options, keys, files, ports. Whoever changes one breaks them."""

from dataclasses import fields

import numpy as np
import pytest

from riseg_drake.app.arguments import command_line
from riseg_drake.app.evaluate.command import PARTS as EVALUATION_PARTS
from riseg_drake.app.exports import EXPORT
from riseg_drake.app.output import RunFolder, Step
from riseg_drake.app.output_folder import read_json
from riseg_drake.app.run.command import ending_figures
from riseg_drake.app.run.interactions import Progress
from riseg_drake.app.scenario import load_scenario
from riseg_drake.evaluation.disturbance import Disturbance, ObjectMotion
from riseg_drake.evaluation.scores import score
from riseg_drake.export.formats import FORMATS
from riseg_drake.pushing.decision import Decision, Ending
from riseg_drake.recording import layout
from riseg_drake.stations.contract import GROUND_TRUTH, STATION_INPUTS, STATION_OUTPUTS
from riseg_drake.stations.scene import SceneConfig

(COMMANDS,) = (action.choices for action in command_line()._actions if action.choices)

SAID = [
    "run",
    "run scenario.yaml --seed 3 --output out --record --meshcat",
    "run --no-meshcat --export coco,bop,npz,bundlesdf,clouds,poses",
    "evaluate --scenes 2 --seed 5 --objects models --jobs 2 --output out",
    "evaluate --suite clutter",
    "segment",
    "segment recording --output out --strict --export npz,poses",
    "segment recording --rerun out.rrd",
    "run --rerun",
    "convert recording folder",
    "score predicted true --json scores.json",
    "hardware",
    "hardware scenario.yaml --export coco",
    "emulate scenario.yaml",
    "bench",
    "diagram scenario.yaml",
    "doctor",
]


@pytest.mark.parametrize("words", SAID)
def test_a_command_line_that_was_agreed_on_is_understood(words):
    assert callable(command_line().parse_args(words.split()).call)


def test_every_command_explains_itself_in_two_lines():
    for name, command in COMMANDS.items():
        assert len(command.description.splitlines()) == 2, name


def test_the_formats_of_export_and_their_folder():
    assert FORMATS == ("coco", "bop", "npz", "bundlesdf", "clouds", "poses")
    assert EXPORT == "export"


def test_the_reasons_why_a_run_ends_and_what_it_leaves():
    assert [ending.value for ending in Ending] == [
        "nothing_left",
        "nothing_valid",
        "no_path",
        "enough_interactions",
        "time",
    ]
    progress = Progress(decision=Decision(ending=Ending.NO_PATH), unsettled_area=0.004)
    assert ending_figures(progress) == {"ended": "no_path", "unsettled_area_m2": 0.004}


def test_a_scene_is_laid_or_placed_by_these_keys(tmp_path):
    (layouts,) = (each.metadata["choices"] for each in fields(SceneConfig) if each.name == "layout")
    assert layouts == ("spread", "packed", "crowd", "pile")
    file = tmp_path / "scenario.yaml"
    file.write_text(
        "station:\n  scene:\n    layout: pile\n"
        "    placed: [{model: a.sdf, X_WB: [0.5, 0.1, 0.0, 0.0, 0.0, 1.5]}, {model: b.urdf}]\n"
    )
    scene = load_scenario(file).station.scene
    assert (scene.layout, [item.model for item in scene.placed]) == ("pile", ["a.sdf", "b.urdf"])
    assert scene.placed[0].X_WB == [0.5, 0.1, 0.0, 0.0, 0.0, 1.5]


def test_a_step_leaves_these_files_and_the_summary_these_keys(tmp_path):
    mask = np.zeros((40, 60), np.uint16)
    mask[10:20, 10:30] = 7
    color = np.full((40, 60, 3), 90, np.uint8)
    step = Step(
        interaction_step=1,
        time=2.0,
        color=color,
        depth=np.full((40, 60), 0.5, np.float32),
        mask=mask,
        frames=30,
        confidence={7: 0.9},
        stage_seconds={"OpticalFlow": [0.01, 0.02]},
        ground_truth=mask,
        scores=score(mask, mask),
        disturbance=Disturbance("box", {"box": ObjectMotion(moved_m=0.02, tilted_deg=1.5)}),
    )
    with RunFolder(tmp_path / "out", {}) as folder:
        folder.write_step(step)
    files = {path.name for path in (tmp_path / "out" / "step_1").iterdir()}
    assert {"color.png", "depth.png", "mask.png", "overlay.png", "ground_truth.png"} <= files
    (entry,) = read_json(tmp_path / "out" / "summary.json")["steps"]
    assert entry["confidence"] == {"7": 0.9}
    assert set(entry["stages"]["OpticalFlow"]) == {"calls", "median_ms", "p95_ms"}
    assert set(entry["scores"]) == {
        "Objects Precision",
        "Objects Recall",
        "Objects F-measure",
        "Boundary Precision",
        "Boundary Recall",
        "Boundary F-measure",
        "obj_detected",
        "obj_detected_075",
        "obj_gt",
        "obj_detected_075_percentage",
    }
    assert {"step", "frames"} <= set(entry)
    assert (entry["motions"]["box"]["moved_m"], entry["motions"]["box"]["tilted_deg"]) == (0.02, 1.5)


def test_an_evaluation_has_a_folder_for_each_scene_and_a_report():
    for name in (r"scene_\d+", r"report\.md", r"figure\.png"):
        assert name in EVALUATION_PARTS


def test_a_recording_has_these_files():
    assert (layout.COLOR_LIST, layout.DEPTH_LIST, layout.POSE_LIST) == (
        "rgb.txt",
        "depth.txt",
        "groundtruth.txt",
    )
    assert (layout.CAMERA_FILE, layout.JOINT_LIST) == ("camera.json", "joints.csv")
    assert layout.CAMERA_KEYS == "width, height, fx, fy, cx, cy, depth_scale"
    assert (layout.ROBOT_FOLDER, layout.LABEL_FOLDER) == ("robot", "label")
    assert layout.HEADERS[layout.JOINT_LIST] == "timestamp,q1,q2,q3,q4,q5,q6,q7"


def test_a_station_has_these_ports():
    assert [port.name for port in STATION_INPUTS] == ["panda.position"]
    assert [port.name for port in STATION_OUTPUTS] == [
        "wrist.color_image",
        "wrist.depth_image",
        "wrist.image_time",
        "panda.position_measured",
        "panda.velocity_measured",
    ]
    assert GROUND_TRUTH == "cheat."
