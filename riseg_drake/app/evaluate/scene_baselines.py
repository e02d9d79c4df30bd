"""Methods that move nothing, on the images of a finished run."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from riseg_drake.app.scenario import Scenario
from riseg_drake.evaluation.baselines import BASELINES, BaselineParameters
from riseg_drake.evaluation.label_folders import read_labels
from riseg_drake.evaluation.scores import Scores, score
from riseg_drake.geometry.rgbd import Frame, sanitize_depth
from riseg_drake.host.images import read_image
from riseg_drake.recording.layout import MILLIMETRES
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.robot.silhouette import RobotSilhouette
from riseg_drake.segmentation.above_table import objects_above_table
from riseg_drake.stations.simulated import start_position


def score_baselines(scenario: Scenario, run: Path, steps: int) -> dict[str, list[Scores]]:
    """The scores of every baseline on the images of `run/step_0` ... `run/step_{steps - 1}`."""
    scores: dict[str, list[Scores]] = {name: [] for name in BASELINES}
    views = ObservationView(scenario)
    for i in range(steps):
        folder = run / f"step_{i}"
        frame = views.read(folder)
        standing = above_table(frame, scenario)
        ground_truth = read_labels(folder / "ground_truth.png")
        for name, segment in BASELINES.items():
            labels = segment(frame.color, frame.depth, standing, frame.intrinsics, BaselineParameters())
            scores[name].append(score(labels, ground_truth))
    return scores


class ObservationView:
    """Turns the images of a step into the frame that they were: all are taken from one posture."""

    def __init__(self, scenario: Scenario):
        self._intrinsics = scenario.simulated.camera.intrinsics
        kinematics = PandaKinematics(scenario.simulated.panda, scenario.simulated.camera.fixed_pose)
        q = np.array(start_position(scenario.simulated))
        self._X_WC = kinematics.X_WC(q)
        self._robot = RobotSilhouette(kinematics, self._intrinsics).mask(q)

    def read(self, step: Path) -> Frame:
        """The frame whose colour and depth are in the folder of a step."""
        color = cv2.cvtColor(read_image(step / "color.png"), cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)
        depth = read_labels(step / "depth.png") / MILLIMETRES
        return Frame(0, 0.0, self._intrinsics, color, sanitize_depth(depth), self._X_WC, self._robot)


def above_table(frame: Frame, scenario: Scenario) -> NDArray[np.bool_]:
    """objMask [H, W] of a frame."""
    try:
        return objects_above_table(frame, scenario.above_table).mask
    except ValueError:  # no table to be seen: then nothing is known to stand on it
        return np.zeros(frame.intrinsics.shape, bool)
