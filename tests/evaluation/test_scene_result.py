"""One scene's outcome, and the scores of many by method and by switch."""

import pytest

from riseg_drake.evaluation.scene_result import SceneResult, scores_by_method, scores_by_switch
from riseg_drake.evaluation.step_means import EMPTY_PREDICTION


def scene(number, steps=0, **others):
    return SceneResult(f"scene_{number:03d}", number, "", "", scores=[EMPTY_PREDICTION] * steps, **others)


@pytest.mark.parametrize(("steps", "interactions"), [(0, 0), (1, 0), (2, 1), (6, 5)])
def test_the_first_scores_are_from_before_the_first_interaction(steps, interactions):
    assert scene(0, steps).interactions == interactions


def test_ours_come_first_then_the_baselines_in_the_order_in_which_they_are_met():
    once, twice = [EMPTY_PREDICTION], [EMPTY_PREDICTION] * 2
    scenes = [scene(0, 2, baselines={"b": once}), scene(1), scene(2, 1, baselines={"a": once, "b": twice})]
    methods = scores_by_method(scenes)
    assert list(methods) == ["riseg_drake", "b", "a"]
    assert methods == {"riseg_drake": [twice, [], once], "b": [once, (), twice], "a": [(), (), once]}


def test_the_switches_of_an_ablation_are_those_of_all_scenes_and_no_baselines():
    once = [EMPTY_PREDICTION]
    scenes = [scene(0, baselines={"a": once}, ablation={"no memory": once}), scene(1, ablation={"all": once})]
    assert scores_by_switch(scenes) == {"no memory": [once, ()], "all": [(), once]}
    assert list(scores_by_switch(scenes)) == ["no memory", "all"]
    assert scores_by_switch([scene(0, baselines={"a": once})]) == {}
