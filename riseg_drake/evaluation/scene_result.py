"""What an evaluation knows of one scene once it is over."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from riseg_drake.evaluation.disturbance import Disturbance
from riseg_drake.evaluation.in_motion import InMotion
from riseg_drake.evaluation.scores import Scores

OURS = "riseg_drake"
"""What this project's own masks are called in tables and figures."""
SAM = "SAM"
OURS_WITH_SAM = f"{OURS} + SAM"
SAM_METHODS = (SAM, OURS_WITH_SAM)
"""Segment Anything alone, and prompted by our masks, as in the paper."""


@dataclass(frozen=True)
class SceneResult:
    """One scene, from its first step to the last that it reached."""

    name: str
    """`scene_003`, the folder of its run."""
    seed: int
    failure: str
    """Why the run failed, in one line; empty if it ended by itself."""
    end: str
    """Why the run ended, in words."""
    ended: str = ""
    """The same as one of five: nothing_left, nothing_valid, no_path, enough_interactions, time; or empty."""
    unsettled_area_m2: float = float("nan")
    """What was yet to be segmented then, m^2."""
    scores: Sequence[Scores] = ()
    """Of our masks, from step 0 on."""
    disturbances: Sequence[Disturbance] = ()
    """Of the interactions, from the first on."""
    in_motion: Sequence[InMotion | None] = ()
    """Of the interactions, from the first on; None where nothing moved in sight."""
    baselines: Mapping[str, Sequence[Scores]] = field(default_factory=dict)
    """Of other methods on the same images, by name, from step 0 on."""
    ablation: Mapping[str, Sequence[Scores]] = field(default_factory=dict)
    """Of the recorded run segmented otherwise, by the switch's name, from step 0 on."""
    ablation_in_motion: Mapping[str, Sequence[InMotion | None]] = field(default_factory=dict)
    """Of the same, while things moved, from the first interaction on."""
    ablation_failures: Mapping[str, str] = field(default_factory=dict)
    """Why a switch failed on the way, by its name; it has the scores that it had until then."""

    @property
    def interactions(self) -> int:
        """How many interactions were made."""
        return max(0, len(self.scores) - 1)


def scores_by_method(scenes: Sequence[SceneResult]) -> dict[str, list[Sequence[Scores]]]:
    """For ours and every baseline the scores of all scenes; a scene that failed may lack some: ()."""
    names = dict.fromkeys(name for scene in scenes for name in scene.baselines)
    methods: dict[str, list[Sequence[Scores]]] = {OURS: [scene.scores for scene in scenes]}
    for name in names:
        methods[name] = [scene.baselines.get(name, ()) for scene in scenes]
    return methods


def scores_by_switch(scenes: Sequence[SceneResult]) -> dict[str, list[Sequence[Scores]]]:
    """For every switch of the ablation the scores of all scenes; empty without an ablation."""
    names = dict.fromkeys(name for scene in scenes for name in scene.ablation)
    return {name: [scene.ablation.get(name, ()) for scene in scenes] for name in names}
