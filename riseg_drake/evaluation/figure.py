"""The paper's figure with ours in it: the share of objects found over the interaction steps."""

from collections.abc import Sequence
from io import BytesIO

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from riseg_drake.evaluation.published import PUBLISHED
from riseg_drake.evaluation.scene_result import OURS, SceneResult, scores_by_method
from riseg_drake.evaluation.step_means import carried, step_deviations, step_means

_OURS_COLOR = "#d55e00"
_BASELINE_COLORS = ("#0072b2", "#56b4e9", "#009e73", "#cc79a7", "#f0a000", "#8a5a2b")
_PAPER_STYLES = (("-", "#222222"), ("--", "#555555"), ("-.", "#777777"), (":", "#777777"))


def figure_png(scenes: Sequence[SceneResult], last_step: int) -> bytes:
    """The figure as a PNG file.

    Ours: the mean over scenes, a band of one standard deviation over scenes, and a dot for every share
    that scenes had, the larger the more scenes had it.
    """
    figure = Figure(figsize=(7.5, 4.5), dpi=150, layout="constrained")
    axes = figure.subplots()
    steps = np.arange(last_step + 1)
    for (method, rows), (line, color) in zip(PUBLISHED.items(), _PAPER_STYLES, strict=True):
        published = [row.found_share for row in rows]
        axes.plot(range(len(rows)), published, line, color=color, lw=1.3, label=f"{method} (paper)")
    methods = scores_by_method(scenes)
    for number, (method, scores) in enumerate(methods.items()):
        if method == OURS:
            continue
        means = np.array([100 * mean.found_share for mean in step_means(scores, last_step)])
        color = _BASELINE_COLORS[(number - 1) % len(_BASELINE_COLORS)]
        axes.plot(steps, means, "s-", color=color, lw=1.3, ms=3.5, label=method)

    means = np.array([100 * mean.found_share for mean in step_means(methods[OURS], last_step)])
    spread = np.array([100 * each.found_share for each in step_deviations(methods[OURS], last_step)])
    low, high = (np.clip(edge, 0, 100) for edge in (means - spread, means + spread))
    axes.fill_between(steps, low, high, color=_OURS_COLOR, alpha=0.18, lw=0, label="± 1 s.d. over scenes")
    each = np.array([[100 * s.found_share for s in carried(scene, last_step)] for scene in methods[OURS]])
    for i in steps:
        shares, count = np.unique(each[:, i], return_counts=True)
        sizes = 90 * count / len(scenes)
        axes.scatter(np.full(len(shares), i), shares, s=sizes, color=_OURS_COLOR, alpha=0.35, lw=0)
    axes.plot(steps, means, "o-", color=_OURS_COLOR, lw=2.4, ms=5, label=OURS)

    axes.set(xlabel="interaction step i", ylabel="objects with Overlap F > 75 %, in percent")
    last_published = max(map(len, PUBLISHED.values())) - 1
    axes.set(xlim=(-0.15, max(last_step, last_published) + 0.15), ylim=(-2, 102))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="y", lw=0.5, alpha=0.5)
    handles, labels = axes.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda n: not labels[n].startswith((OURS, "±")))
    figure.legend(
        [handles[n] for n in order],
        [labels[n] for n in order],
        loc="outside right center",
        fontsize=8,
        frameon=False,
    )
    file = BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()
