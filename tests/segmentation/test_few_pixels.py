"""Frames in motion come in fewer pixels; what a rest decides does not know of it."""

import numpy as np
import pytest

from riseg_drake.geometry.camera import Intrinsics
from riseg_drake.segmentation import algorithm
from riseg_drake.segmentation.frame_pairs import FramePairParameters
from riseg_drake.segmentation.segment import SegmentParameters
from tests.segmentation.drawn_scene import DrawnScene, intersection_over_union, looking_down, planar
from tests.segmentation.watched import Watcher

VGA = Intrinsics(640, 480, 616.2, 615.8, 316.9, 239.3)
SIZES = [(0.07, 0.06, 0.03), (0.06, 0.07, 0.05)]
STEPS = np.concatenate([np.zeros(4), np.linspace(0.002, 0.02, 10), np.full(4, 0.02)])
"""m; by which the first box has moved in each frame: it rests, is pushed, and rests."""


@pytest.fixture(scope="module")
def film():
    scene, rng = DrawnScene(SIZES, intrinsics=VGA), np.random.default_rng(0)
    places = [[planar(-0.06 - step, 0.01, 4 * step), planar(0.05, 0.0)] for step in STEPS]
    return [scene.frame(k, looking_down(), each, rng) for k, each in enumerate(places)]


def masks(film, width: int):
    watcher = Watcher(frame_pair=FramePairParameters(width=width))
    return [watcher.take(frame).mask for frame, _ in film]


@pytest.fixture(scope="module")
def of_few(film):
    return masks(film, 320)


@pytest.mark.renders
def test_a_rest_decides_to_the_pixel_what_it_would_with_whole_frames_before_it(film, of_few) -> None:
    np.testing.assert_array_equal(of_few[-1], masks(film, 0)[-1])
    assert intersection_over_union(of_few[-1] > 0, film[-1][1] == 1) > 0.97


@pytest.mark.renders
def test_a_mask_in_motion_has_all_pixels_of_the_camera_and_the_outline_of_its_depth(film, of_few) -> None:
    for mask, (_, label) in list(zip(of_few, film, strict=True))[7:14]:
        assert mask.shape == VGA.shape
        assert intersection_over_union(mask > 0, label == 1) > 0.96


@pytest.mark.renders
def test_the_whole_of_what_stands_there_is_asked_for_by_what_decides_alone(film, monkeypatch) -> None:
    asked = []
    work = algorithm.objects_above_table
    monkeypatch.setattr(
        algorithm, "objects_above_table", lambda f, p: asked.append((f.time, f.depth.shape)) or work(f, p)
    )
    watcher, deciding, before = Watcher(), [], None
    for number, (frame, _) in enumerate(film):
        seen = watcher.take(frame).segmentation
        if seen.still_since is not None or seen.belief is not before:
            deciding.append(number)
        before = seen.belief
    whole = [k for k, (_, shape) in enumerate(asked) if shape == VGA.shape]
    frames_before = np.cumsum([shape != VGA.shape for _, shape in asked])
    assert [int(frames_before[k]) - 1 for k in whole] == deciding
    assert len(deciding) < len(film) - 5


def test_the_literal_paper_is_given_whole_frames() -> None:
    assert algorithm.SegmentObjsParameters().width == 320
    assert algorithm.SegmentObjsParameters(segment=SegmentParameters(method="paper")).width == 0
