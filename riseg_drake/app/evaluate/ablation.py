"""What each part of Alg. 2 is worth, the paper's own among them: recorded runs segmented again, one switch at a
time."""

import copy
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.segment.replay import Replay
from riseg_drake.app.segmentation_block import panda_view
from riseg_drake.evaluation.scores import Scores, score
from riseg_drake.recording.layout import RecordedFrame, RecordingError
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.robot.kinematics import PandaKinematics

Switch = Mapping[str, Any]
"""Keys of the scenario and what they are set to."""

AS_IN_THE_PAPER: dict[str, Switch] = {
    "body frames: triplets, not patches": {"bfif.frames.kind": "triplets"},
    "covariance: of the sample, not propagated": {"bfif.grouping.covariance": "sample"},
    "pair: consecutive frames, not by motion": {"frame_pair.kind": "consecutive"},
    "line 7: to the letter, not by evidence": {"segment.method": "paper"},
}
"""Where this project departs from the paper, by what the report calls it."""

WITHOUT: dict[str, Switch] = {
    "no motions proposed by lines 3 to 6": {"bfif.grouping.members_min": 10**6},
    "no motions searched for at rest": {"segment.evidence.search.rounds": 0},
    "no motions searched for in motion": {"segment.evidence.search_every": 1e6},
    "nothing of borders from the still picture": {
        f"segment.evidence.belief.prior.{cue}": 0.0 for cue in ("dent", "valley", "color", "hole")
    },
    "no borders behind what is in front": {"segment.evidence.belief.keyframe.behind": 0.0},
    "no borders across gaps": {"segment.evidence.belief.keyframe.gap": 0.0},
    "no evidence kept from one rest to the next": {"segment.evidence.belief.most": 0.0},
    "no memory of what left the view": {"segment.evidence.memory": False},
    "no keyframe seen again from nearby": {"segment.evidence.creep": 0.0},
    "alike motions count at every push": {"segment.evidence.belief.once": False},
    "alike motions count, however little is shown": {"segment.evidence.observation.touching": -2.0},
}
"""What line 7 by evidence consists of, by what is missing."""

LITERAL = "everything as in the paper"
LITERAL_STEPS = (0.2, 0.5, 1.0, 2.0)
"""s between t-1 and t, up to a whole push: the paper does not give its time step, so it has every chance."""


@dataclass(frozen=True)
class Ablation:
    """What became of one recorded run with every version."""

    scores: dict[str, list[Scores]]
    """After each step of the run; fewer where the version failed on the way."""
    failures: dict[str, str]
    """Why, in one line, for the versions that failed."""


def versions() -> dict[str, Switch]:
    """All that are compared with this version: each switch alone, and the paper at some time steps."""
    literal: Switch = reduce(operator.or_, AS_IN_THE_PAPER.values(), {})
    scanned = {f"{LITERAL}, {step:g} s": {**literal, "frame_pair.step": step} for step in LITERAL_STEPS}
    return {**AS_IN_THE_PAPER, **WITHOUT, LITERAL: literal, **scanned}


def switched(scenario: Scenario, switch: Switch) -> Scenario:
    """A copy of a scenario with some keys (`bfif.frames.kind`) set otherwise; ValueError for a strange one."""
    other = copy.deepcopy(scenario)
    for path, value in switch.items():
        *rooms, key = path.split(".")
        room = reduce(getattr, rooms, other)
        if not hasattr(room, key):
            raise ValueError(f"a scenario has no key {path!r}")
        setattr(room, key, value)
    return other


def ablate(scenario: Scenario, seed: int, recording: Path, times: Sequence[float]) -> "Ablation":
    """Segment a recording with every version and score the masks at some times.

    Args:
        scenario: of the recorded run.
        seed: of the recorded run.
        recording: its folder, with joint angles and true labels.
        times: of the frames to score, s, in rising order: the steps of the run.

    Raises:
        RecordingError: a frame of these times, or its true labels, are missing.
    """
    kinematics = PandaKinematics(scenario.station.panda, scenario.station.camera.fixed_pose)
    replays = {
        name: Replay(switched(scenario, switch), panda_view(scenario, kinematics), seed)
        for name, switch in versions().items()
    }
    scores: dict[str, list[Scores]] = {name: [] for name in replays}
    failures: dict[str, str] = {}
    wanted = [round(time, 6) for time in times]
    for frame in RecordingReader(recording):
        if not wanted:
            break
        counts = round(frame.time, 6) == wanted[0]
        for name in list(replays):
            try:
                mask = replays[name].mask_after(frame)
            except (ValueError, RuntimeError, ArithmeticError) as error:
                failures[name] = " ".join(str(error).split())
                del replays[name]
                continue
            if counts:
                scores[name].append(score(mask, _labels(frame, recording)))
        if counts:
            wanted.pop(0)
    if wanted:
        raise RecordingError(f"{recording} has no frame at {wanted[0]} s")
    return Ablation(scores, failures)


def _labels(frame: RecordedFrame, recording: Path) -> Any:
    if frame.labels is None:
        raise RecordingError(f"{recording} has no true labels at {frame.time} s")
    return frame.labels
