"""What the pages take for given: a recording, a robot, masks, a scenario, each under the name that they use."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from tests.recording.made_recordings import drawn_frames, write

GANTRY = """<robot name="gantry"><link name="base"/><link name="hand"/>
<joint name="x" type="prismatic"><parent link="base"/><child link="hand"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<link name="my_optical_frame"/><joint name="mount" type="fixed">
<parent link="hand"/><child link="my_optical_frame"/>
<origin xyz="0 0 0.45" rpy="3.14159265 0 0"/></joint></robot>"""

CUBE = """<sdf version="1.9"><model name="cube"><link name="cube"><pose>0 0 0.025 0 0 0</pose>
<inertial><mass>0.1</mass><inertia><ixx>1e-4</ixx><iyy>1e-4</iyy><izz>1e-4</izz></inertia></inertial>
<visual name="seen"><geometry><box><size>0.05 0.05 0.05</size></box></geometry></visual>
<collision name="felt"><geometry><box><size>0.05 0.05 0.05</size></box></geometry></collision>
</link></model></sdf>"""

ROBOT_RECORDING = "recording_of_my_robot"
"""Stands in for `my_recording` where a page names a robot, since then its joint angles must be that robot's."""


def give(folder: Path) -> None:
    """Put all of it into a folder."""
    frames = drawn_frames(6)
    write(folder / "my_recording", frames)
    write(folder / ROBOT_RECORDING, [replace(f, X_WC=None, position=np.zeros(1)) for f in frames])
    joints = folder / ROBOT_RECORDING / "joints.csv"
    joints.write_text("\n".join(["timestamp,x", *joints.read_text().splitlines()[1:]]) + "\n")
    (folder / "my_robot.urdf").write_text(GANTRY)
    (folder / "my_scenario.yaml").write_text("arm: {most_interactions: 3}\n")
    (folder / "my_models").mkdir()
    for k in range(6):
        (folder / "my_models" / f"cube_{k}.sdf").write_text(CUBE)
    for name in ("predicted", "true"):
        (folder / name).mkdir()
        cv2.imwrite(str(folder / name / "000.png"), np.eye(32, dtype=np.uint16).repeat(8, 0).repeat(8, 1))
