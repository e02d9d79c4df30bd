"""The report that a run leaves: before and after each interaction, what came of it, and what is in doubt."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from riseg_drake.app.output import Step, stage_figures
from riseg_drake.app.report_page import (
    Moment,
    Report,
    found_objects,
    report_html,
    scores_table,
    times_table,
    told_facts,
    view,
)


def run_report(summary: Mapping[str, Any], steps: Sequence[Step]) -> str:
    """The page of a run, from what its summary says and from its steps, of which there may be none."""
    titles = {key: str(summary[key]) for key in ("scenario", "seed") if key in summary}
    facts = [*told_facts(), *titles.items()]
    if "seconds" in summary:
        facts.append(
            ("took", f"{summary['seconds']:.0f} s, {summary['simulated_s']:.0f} s of the robot's time")
        )
    scored = [(str(step.interaction_step), step.scores) for step in steps if step.scores is not None]
    stages = pooled_stages(steps)
    return report_html(
        Report(
            title=", seed ".join(titles.values()) or "a run",
            facts=facts,
            ending=f"{str(summary['state']).capitalize()}: {summary['end']}.",
            views=[
                view(_when(step), step.color, step.mask, step.ground_truth, step.confidence) for step in steps
            ],
            moments=_moments(steps),
            objects=found_objects(np.unique(steps[-1].mask[steps[-1].mask > 0]), steps[-1].confidence)
            if steps
            else [],
            doubts=_doubts(summary, steps),
            tables=[
                *([scores_table(scored, "after interaction")] if scored else []),
                *([times_table(stages)] if stages else []),
            ],
        )
    )


def pooled_stages(steps: Sequence[Step]) -> dict[str, dict[str, float]]:
    """The time of each stage over all steps."""
    seconds: dict[str, list[float]] = defaultdict(list)
    for step in steps:
        for stage, times in step.stage_seconds.items():
            seconds[stage].extend(times)
    return stage_figures(seconds)


def _moments(steps: Sequence[Step]) -> list[Moment]:
    if len(steps) == 1:
        return [Moment("Before any push", [_what(steps[0])], [0])]
    return [
        Moment(f"Interaction {step.interaction_step}", _happened(step), [k, k + 1])
        for k, step in enumerate(steps[1:])
    ]


def _when(step: Step) -> str:
    when = f"after interaction {step.interaction_step}" if step.interaction_step else "before any push"
    return f"{when}: {_what(step)}"


def _what(step: Step) -> str:
    scores = f", Overlap F {100 * step.scores.overlap_f:.1f} %" if step.scores is not None else ""
    return f"{step.objects} object{'' if step.objects == 1 else 's'} found{scores}"


def _happened(step: Step) -> list[str]:
    says = []
    if step.disturbance is not None:
        pushed = step.disturbance.pushed
        says.append(f"pushed: {pushed}" if pushed else "the push hit nothing that is known")
    if step.in_motion is not None:
        f = 100 * step.in_motion.overlap_f
        says.append(f"while it moved, what moved had an Overlap F of {f:.1f} %")
    return says


def _doubts(summary: Mapping[str, Any], steps: Sequence[Step]) -> list[str]:
    doubts = []
    if steps and steps[-1].untouched is not None and (clusters := int(steps[-1].untouched.max())):
        doubts.append(
            f"Not moved yet: {clusters} cluster{'' if clusters == 1 else 's'} of depth, guessed "
            f"({100 * steps[-1].untouched_confidence:.0f} %)."
        )
    area = summary.get("unsettled_area_m2")
    if area is not None and np.isfinite(area):
        doubts.append(f"To be segmented still, as the push planner sees it: {1e4 * area:.0f} cm².")
    return doubts
