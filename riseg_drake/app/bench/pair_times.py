"""What Alg. 2 takes for an image pair, beside what the optical flow of the whole images takes."""

from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from riseg_drake.app.output import stage_figures
from riseg_drake.segmentation.optical_flow import DisFlow, DisFlowParameters

MOVING, STILL, FLOW = "pair, something moves", "pair, nothing moves", "DIS of the whole images"
_OPENCVS_REFINEMENTS = 5


@dataclass
class PairTimes:
    """Wall times of image pairs, s."""

    moving: list[float] = field(default_factory=list)
    """Of those in which something moves."""
    still: list[float] = field(default_factory=list)
    """Of the others."""
    flow: list[float] = field(default_factory=list)
    """Of DIS, as OpenCV's preset "medium" has it, over the whole of the same images: dense flow is what cannot
    be avoided."""

    def book(self, seconds: float, *, moves: bool) -> None:
        """One more pair, that took `seconds`, s; something moves in it or not."""
        (self.moving if moves else self.still).append(seconds)

    def measure_flow(self, color_0: NDArray[np.uint8], color_1: NDArray[np.uint8]) -> None:
        """Time the flow of a pair of images [H, W, 3]."""
        dis = DisFlow(DisFlowParameters("medium", _OPENCVS_REFINEMENTS))
        start = perf_counter()
        dis(color_0, color_1)
        self.flow.append(perf_counter() - start)

    @property
    def by_name(self) -> dict[str, list[float]]:
        """All of them, s, by what the table calls them."""
        return {MOVING: self.moving, STILL: self.still, FLOW: self.flow}

    def figures(self) -> dict[str, dict[str, float]]:
        """For each that there is: calls, median, 95th percentile and longest in milliseconds, and these three
        in medians of the flow's."""
        unit = 1e3 * float(np.median(self.flow))
        figures = stage_figures(self.by_name)
        for name, each in figures.items():
            each["longest_ms"] = round(1e3 * max(self.by_name[name]), 3)
            for key in ("median", "p95", "longest"):
                each[f"{key}_ratio"] = round(each[f"{key}_ms"] / unit, 2)
        return figures

    def said(self) -> list[str]:
        """A line for each kind of pair."""
        return [
            f"{name}: {each['median_ratio']:.1f}, {each['p95_ratio']:.1f} and {each['longest_ratio']:.1f} "
            f"times the flow of the whole images (median, 95th percentile, longest of {each['calls']:.0f})"
            for name, each in self.figures().items()
            if name != FLOW
        ]
