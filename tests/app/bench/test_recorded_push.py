from dataclasses import replace

import numpy as np
import pytest

from riseg_drake.app.bench.recorded_push import push_frames, push_images, put_through
from riseg_drake.app.flow_method import flow_method
from riseg_drake.app.scenario import load_scenario
from riseg_drake.app.scenario_file import ScenarioError
from riseg_drake.app.segmentation_block import make_segmentation, panda_view
from riseg_drake.robot.kinematics import PandaKinematics
from riseg_drake.segmentation.algorithm import no_frame_segmented, segment_objs

pytestmark = pytest.mark.renders


def test_each_image_goes_through_once_and_the_ports_speak_of_it(small_scenario):
    scenario = load_scenario(small_scenario)
    images = push_images(scenario, seed=1)
    period = 1 / scenario.station.camera.rate
    view = panda_view(scenario, PandaKinematics(scenario.station.panda))
    segmentation, _ = make_segmentation(scenario, view, period, seed=0)
    times, masks = [], []
    for context in put_through(segmentation, images, period):
        times.append(segmentation.GetOutputPort("pair").Eval(context).current.time)
        masks.append(segmentation.GetOutputPort("mask").Eval(context))
    np.testing.assert_allclose(times, [float(now["image_time"][0]) for now in images])
    assert masks[-1].any()


def test_its_frames_through_the_function_give_the_masks_of_the_wired_systems(small_scenario):
    scenario = load_scenario(small_scenario)
    images, frames = push_images(scenario, seed=1), push_frames(scenario, seed=1)
    period = 1 / scenario.station.camera.rate
    view = panda_view(scenario, PandaKinematics(scenario.station.panda))
    segmentation, _ = make_segmentation(scenario, view, period, seed=0)
    seen = no_frame_segmented(view.intrinsics.shape)
    # What the frames themselves know is of the whole run: their number, and their exposure beside others.
    frames = [replace(frame, gain=1.0) for frame in frames]
    for frame, context in zip(frames, put_through(segmentation, images, period), strict=True):
        seen = segment_objs(seen, frame, flow_method(scenario.optical_flow), scenario.segment_objs)
        np.testing.assert_array_equal(segmentation.GetOutputPort("mask").Eval(context), seen.mask)
    assert seen.mask.any()


def test_a_scene_without_a_push_is_one_line_that_says_so(small_scenario):
    scenario = load_scenario(small_scenario)
    scenario.arm.most_interactions = 0
    with pytest.raises(ScenarioError, match="choose another seed"):
        push_images(scenario, seed=1)
