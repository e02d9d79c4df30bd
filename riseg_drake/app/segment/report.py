"""The report of a segmented recording: what was seen before and after each change of what is known."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from riseg_drake.app.report_page import (
    Moment,
    Report,
    View,
    found_objects,
    report_html,
    scores_table,
    times_table,
    told_facts,
    view,
)
from riseg_drake.evaluation.scores import Scores
from riseg_drake.recording.layout import RecordedFrame
from riseg_drake.segmentation.segmentation import Segmentation
from riseg_drake.segmentation.untouched import untouched_clusters

MOST_VIEWS = 12
"""More changes than these are thinned out, the first and the last kept: a page is to stay small."""


class Album:
    """Keeps the pictures of a recording that show something new, and what they say."""

    def __init__(self) -> None:
        self._views: list[View] = []
        self._known: tuple[int, ...] | None = None
        self._last: tuple[RecordedFrame, Segmentation] | None = None
        self._start = 0.0

    def look(self, frame: RecordedFrame, segmentation: Segmentation) -> None:
        """Take note of a frame, and keep it where other objects are known than before."""
        if self._known is None:
            self._start = frame.time
        self._last = frame, segmentation
        if segmentation.object_ids != self._known:
            self._known = segmentation.object_ids
            self._keep()

    def page(
        self,
        title: str,
        summary: Mapping[str, Any],
        rows: Sequence[tuple[str, Scores]],
        stages: Mapping[str, Mapping[str, float]],
    ) -> str:
        """The report, as HTML: scores and times beside what was kept, and the newest frame."""
        if self._last is not None:
            self._keep()
        moments = [
            Moment(_change(before, after), [], [k, k + 1])
            for k, (before, after) in enumerate(zip(self._views, self._views[1:], strict=False))
        ]
        names = ("recording", "seed", "camera_poses", "robot_pixels", "frames")
        facts = [(name.replace("_", " "), str(summary[name])) for name in names if name in summary]
        if "seconds" in summary:
            facts.append(("took", f"{summary['seconds']:.0f} s"))
        return report_html(
            Report(
                title=title,
                facts=[*told_facts(), *facts],
                ending=f"{str(summary['state']).capitalize()}: {summary['end']}.",
                views=self._views,
                moments=moments,
                objects=found_objects(self._known or (), self._last[1].confidence if self._last else {}),
                doubts=self._doubts(summary),
                tables=[
                    *([scores_table(rows, "frames")] if rows else []),
                    *([times_table(stages)] if stages else []),
                ],
            )
        )

    def _keep(self) -> None:
        """Keep the newest frame, once."""
        assert self._last is not None
        frame, segmentation = self._last
        number = len(segmentation.object_ids)
        caption = f"{frame.time - self._start:.1f} s: {number} object{'' if number == 1 else 's'} known"
        kept = view(caption, frame.color, segmentation.mask, frame.labels, segmentation.confidence)
        if self._views and self._views[-1] == kept:
            return
        self._views.append(kept)
        if len(self._views) > MOST_VIEWS:
            del self._views[1:-1:2]

    def _doubts(self, summary: Mapping[str, Any]) -> list[str]:
        doubts = []
        if self._last is not None:
            clusters: NDArray[np.uint16] = untouched_clusters(self._last[1])
            if number := int(clusters.max()):
                doubts.append(f"Not moved yet: {number} cluster{'' if number == 1 else 's'} of depth, guessed.")
        if left_out := len(summary.get("left_out", ())):
            doubts.append(f"Left out: {left_out} line{'' if left_out == 1 else 's'} (summary.json says why).")
        return [*doubts, *map(str, summary.get("warnings", ()))]


def _change(before: View, after: View) -> str:
    """From when to when, as the captions have it."""
    return f"From {before.caption.partition(':')[0]} to {after.caption.partition(':')[0]}"
