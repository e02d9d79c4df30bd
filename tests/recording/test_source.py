"""What all sources have in common, by one that has stamps alone."""

import numpy as np
import pytest

from riseg_drake.geometry.rgbd import LIKELY_DEPTH
from riseg_drake.recording.source import STAMP_LIMIT, RecordedSource, SourceOptions


class Stamped(RecordedSource):
    """Frames with these stamps, and nothing in them."""

    def __init__(self, *times):
        self._times, self.warnings, self.left_out = list(times), [], []

    def __len__(self):
        return len(self._times)

    def __iter__(self):
        return iter(())

    def leave_out(self, frame, why):
        """Nothing is left out."""

    def times(self):
        """As they were given, s."""
        return self._times


def test_the_rate_is_that_of_the_median_gap_whatever_one_pause_lasts():
    assert Stamped(0.0, 0.1, 0.2, 5.2, 5.3).rate == pytest.approx(10.0)
    assert Stamped(3.0, 3.25).rate == pytest.approx(4.0)
    assert Stamped(3.0).rate == 1.0


def test_a_source_has_no_images_but_its_frames_unless_it_says_so():
    source = Stamped(0.0)
    assert source.holds_images("label") is False
    assert source.images_beside("label") == 0


def test_stamps_belong_together_within_the_20_ms_of_the_tum_tools():
    assert SourceOptions().stamp_limit == STAMP_LIMIT == 0.02


@pytest.mark.parametrize(
    ("metres", "odd"),
    [(0.09, True), (0.11, False), (1.0, False), (9.9, False), (10.1, True), (0.0, False)],
)
def test_a_depth_of_which_most_is_nearer_than_10_cm_or_farther_than_10_m_is_unlikely(metres, odd):
    # Nearly a half of the pixels that have depth are far off, and of all pixels most have none.
    depth = np.zeros((6, 6), np.float32)
    depth[0] = metres
    depth[1, :2] = 500.0 if metres else 0.0
    depth[1, 2:5] = 0.001 if metres else 0.0
    source = Stamped(0.0)
    source._look_at_scale(depth, "a.png")
    assert LIKELY_DEPTH == (0.1, 10.0)
    expected = f"a.png: the median depth is {metres:.3g} m, which is unlikely; "
    expected += 'is "depth_scale" (units per metre) right?'
    assert source.warnings == ([expected] if odd else [])
