"""What each part of Alg. 2 is worth, the paper's own among them: recorded runs segmented again, one switch at a
time."""

import copy
import operator
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from riseg_drake.app.scenario import Scenario
from riseg_drake.app.segment.replay import Replay
from riseg_drake.app.segmentation_block import panda_view
from riseg_drake.evaluation.in_motion import FramesInMotion, InMotion
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
    "in motion whole frames, not reduced": {"frame_pair.width": 0},
    "what goes behind something counts as hidden": {"segment.evidence.observation.likelihood.covered": 1.0},
    "alike motions count at every push": {"segment.evidence.belief.once": False},
    "any change of light costs what its factor says": {"segment.evidence.observation.likelihood.shadow": 1e9},
    "what was told apart is forgotten where it parts": {"segment.evidence.belief.told": False},
    "what came to where nothing stood has not moved": {"segment.evidence.belief.arrivals": False},
    "what falls off a body stays what that was known to be": {"segment.evidence.belief.strangers": False},
    "each frame in motion says all it has": {"segment.evidence.fresh": 1.0},
    "each frame in motion says where all is": {"segment.evidence.area_seen": 0.0},
    "what is seen in pieces is a body each": {"segment.evidence.belief.keyframe.pieces": False},
    "nothing rolls": {"segment.evidence.search.roll": 0.0},
    "what tilts is lit as it was": {"segment.evidence.observation.likelihood.light_tilt": 0.0},
    "nothing is recognised": {"segment.evidence.search.recognition.most": 0},
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
    in_motion: dict[str, list[InMotion | None]]
    """While things moved, in each interaction; None where nothing moved in sight."""
    failures: dict[str, str]
    """Why, in one line, for the versions that failed."""


@dataclass(frozen=True)
class RecordedStep:
    """A step of the recorded run: which frames are to be scored."""

    time: float
    """Of the frame at rest that ends it, s."""
    moved: Mapping[float, Collection[int]] = field(default_factory=dict)
    """By the time of each frame in motion before that, s, the true ids of what had moved."""

    @classmethod
    def from_summary(cls, step: Mapping[str, Any]) -> "RecordedStep":
        """As the run's `summary.json` has it."""
        return cls(step["time_s"], {frame["time_s"]: frame["ids"] for frame in step.get("moved", ())})


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


def ablate(scenario: Scenario, seed: int, recording: Path, steps: Sequence[RecordedStep]) -> Ablation:
    """Segment a recording with every version, and score the masks at the steps of its run and in motion.

    Args:
        scenario: of the recorded run.
        seed: of the recorded run.
        recording: its folder, with joint angles and true labels.
        steps: of the run, in the order of time; the first is before any interaction.

    Raises:
        RecordingError: a frame at rest of these steps, or the true labels of any of their frames, are missing.
    """
    kinematics = PandaKinematics(scenario.station.panda, scenario.station.camera.fixed_pose)
    scored = {
        name: _Version(Replay(switched(scenario, switch), panda_view(scenario, kinematics), seed))
        for name, switch in versions().items()
    }
    alive = dict(scored)
    failures: dict[str, str] = {}
    ends = {_stamp(step.time) for step in steps}
    moved = {_stamp(time): ids for step in steps for time, ids in step.moved.items()}
    for frame in RecordingReader(recording):
        if not ends:
            break
        time = _stamp(frame.time)
        labels = _labels(frame, recording) if time in ends or time in moved else None
        for name, version in list(alive.items()):
            try:
                mask = version.replay.mask_after(frame)
            except (ValueError, RuntimeError, ArithmeticError) as error:
                failures[name] = " ".join(str(error).split())
                del alive[name]
                continue
            if labels is not None and time in moved:
                version.frames.score(time, moved[time], mask, labels)
            if labels is not None and time in ends:
                version.close(mask, labels)
        ends.discard(time)
    if ends:
        raise RecordingError(f"{recording} has no frame at {min(ends)} s")
    return Ablation(
        scores={name: version.scores for name, version in scored.items()},
        in_motion={name: version.in_motion[1:] for name, version in scored.items()},  # step 0 is no interaction
        failures=failures,
    )


class _Version:
    """What became of one version so far."""

    def __init__(self, replay: Replay):
        self.replay = replay
        self.frames = FramesInMotion()
        """Since the last step."""
        self.scores: list[Scores] = []
        self.in_motion: list[InMotion | None] = []

    def close(self, mask: NDArray, labels: NDArray) -> None:
        """Score the frame at rest that ends a step."""
        self.scores.append(score(mask, labels))
        self.in_motion.append(self.frames.closed(mask, labels))
        self.frames = FramesInMotion()


def _stamp(time: float) -> float:
    """A time that is the same, s, whatever its last digits became in a file."""
    return round(time, 6)


def _labels(frame: RecordedFrame, recording: Path) -> NDArray:
    if frame.labels is None:
        raise RecordingError(f"{recording} has no true labels at {frame.time} s")
    return frame.labels
