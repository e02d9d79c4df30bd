"""PushPlanner through its ports."""

from dataclasses import dataclass

import numpy as np
import pytest
from pydrake.common.value import Value

from riseg_drake.geometry.camera import Intrinsics, rays
from riseg_drake.geometry.rgbd import NO_PAIR, Frame, FramePair
from riseg_drake.pushing import push_planning
from riseg_drake.pushing.decision import UNDECIDED, Ending
from riseg_drake.pushing.find_action import FindActionParameters
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.pushing.push_path import plan_push_path
from riseg_drake.pushing.push_planning import PushPlanningParameters
from riseg_drake.pushing.tried_pushes import TriedPush
from riseg_drake.robot.kinematics import PandaKinematics, observation_posture, observe_pose
from riseg_drake.systems import push_planner
from riseg_drake.systems.push_planner import PushPlanner

CAMERA = Intrinsics(640, 480, 616.285, 615.778, 301.418, 232.864)


@dataclass(frozen=True)
class AboveTable:
    mask: np.ndarray
    height: np.ndarray
    plane_W: np.ndarray


@pytest.fixture(scope="module")
def panda():
    return PandaKinematics()


@pytest.fixture(scope="module")
def q_observe(panda):
    return panda.solve_ik(observe_pose([0.5, 0.0, 0.0], 0.5, panda.X_EC))


@pytest.fixture(scope="module")
def q_leaning(panda):
    return observation_posture(panda, [0.5, 0.0], 0.5, pitch=np.pi / 4)


@pytest.fixture(scope="module")
def scene(panda, q_observe):
    return seen_from(panda, q_observe)


def seen_from(panda, q_observe):
    """A flat cylinder of 3 cm radius and 4 cm height at (0.5, 0.05), as the wrist camera sees its top."""
    X_WC = panda.X_WC(q_observe)
    direction_W = rays(CAMERA) @ X_WC[:3, :3].T
    to_top = (0.04 - X_WC[2, 3]) / direction_W[..., 2]
    p_WQ = X_WC[:3, 3] + to_top[..., None] * direction_W
    top = np.linalg.norm(p_WQ[..., :2] - [0.5, 0.05], axis=-1) < 0.03
    depth = np.where(top, to_top, -X_WC[2, 3] / direction_W[..., 2]).astype(np.float32)
    color = np.zeros((*CAMERA.shape, 3), np.uint8)
    frame = Frame(3, 0.2, CAMERA, color, depth, X_WC, np.zeros(CAMERA.shape, bool))
    above = AboveTable(top, np.where(top, 0.04, 0.0), np.array([0.0, 0.0, 1.0, 0.0]))
    return FramePair(frame, frame), above


def evaluate(panda, q_observe, pair, above, mask, tried=None, seed=0, found=None):
    planner = PushPlanner(panda, seed=seed)
    context = planner.CreateDefaultContext()
    planner.GetInputPort("pair").FixValue(context, Value[object](pair))
    planner.GetInputPort("above_table").FixValue(context, Value[object](above))
    planner.GetInputPort("mask").FixValue(context, Value[object](mask))
    planner.GetInputPort("position").FixValue(context, q_observe)
    if tried is not None:
        planner.GetInputPort("tried_pushes").FixValue(context, Value[object](tried))
    if found is not None:
        planner.GetInputPort("found").FixValue(context, Value[object](found))
    return planner.GetOutputPort("decision").Eval(context)


NOTHING = np.zeros(CAMERA.shape, np.uint16)


def test_push_goes_through_the_object_and_has_a_path_from_here_to_here(panda, q_observe, scene):
    push = evaluate(panda, q_observe, *scene, NOTHING).push
    assert push.center_W == pytest.approx([0.5, 0.05], abs=0.002)
    assert push.path.position(0.0) == pytest.approx(q_observe)
    assert push.path.position(push.path.duration) == pytest.approx(q_observe)
    reached = panda.X_WE(push.path.position(push.path.push_end))[:2, 3]
    # The bar's face has moved the object's outline by d_push: what is left to the center is less.
    assert np.linalg.norm(reached - push.center_W) == pytest.approx(0.03 + 0.01 - 0.02, abs=0.003)


def test_from_a_view_at_45_degrees_a_push_with_a_path_is_found_at_once(panda, q_leaning, monkeypatch):
    asked = []

    def plan_path(*arguments):
        asked.append(plan_push_path(*arguments))
        return asked[-1]

    monkeypatch.setattr(push_planning, "plan_push_path", plan_path)
    decision = evaluate(panda, q_leaning, *seen_from(panda, q_leaning), NOTHING)
    assert decision.ending is None
    assert decision.push.center_W == pytest.approx([0.5, 0.05], abs=0.003)
    assert decision.push.path.position(0.0) == pytest.approx(q_leaning)
    assert decision.push.path.position(decision.push.path.duration) == pytest.approx(q_leaning)
    reached = panda.X_WE(decision.push.path.position(decision.push.path.push_end))
    assert np.linalg.norm(reached[:2, 3] - decision.push.center_W) == pytest.approx(
        0.03 + 0.01 - 0.02, abs=0.004
    )
    np.testing.assert_allclose(reached[:3, 2], [0, 0, -1], atol=2e-3)
    assert len(asked) <= 5  # of some 270 valid candidates


def test_segmented_scene_gives_null(panda, q_observe, scene):
    decision = evaluate(panda, q_observe, *scene, scene[1].mask.astype(np.uint16))
    assert decision.push is NO_PUSH
    assert decision.ending is Ending.NOTHING_LEFT


def test_what_is_found_and_not_settled_is_in_doubt_and_pushed_beside_its_middle(panda, q_observe, scene):
    decision = evaluate(panda, q_observe, *scene, NOTHING, found=3 * scene[1].mask.astype(np.uint16))
    assert decision.doubtful_area == decision.unsettled_area == pytest.approx(np.pi * 0.03**2, rel=0.08)
    assert np.linalg.norm(decision.push.center_W - [0.5, 0.05]) > 0.01
    unknown = evaluate(panda, q_observe, *scene, NOTHING, found=NOTHING)
    assert unknown.doubtful_area == 0.0
    assert unknown.push.center_W == pytest.approx([0.5, 0.05], abs=0.002)


def test_before_the_first_frame_nothing_is_decided(panda, q_observe, scene):
    assert evaluate(panda, q_observe, NO_PAIR, scene[1], NOTHING) is UNDECIDED


def test_same_seed_and_frame_give_the_same_push(panda, q_observe, scene):
    first, second = (evaluate(panda, q_observe, *scene, NOTHING, seed=5).push for _ in range(2))
    assert np.array_equal(first.p_WE, second.p_WE)


def test_push_tried_in_vain_is_not_proposed_again(panda, q_observe, scene):
    first = evaluate(panda, q_observe, *scene, NOTHING).push
    tried = (TriedPush(first.p_WB, first.direction_W, changed=False),)
    second = evaluate(panda, q_observe, *scene, NOTHING, tried=tried).push
    assert first.direction_W @ second.direction_W < np.cos(0.5)


def test_ports_have_the_names_of_the_contract(panda):
    planner = PushPlanner(panda)
    names = [planner.get_input_port(i).get_name() for i in range(planner.num_input_ports())]
    assert names == ["pair", "above_table", "mask", "position", "tried_pushes", "found"]
    assert planner.get_output_port().get_name() == "decision"


@pytest.mark.parametrize("given", [True, False])
def test_the_function_is_handed_what_the_ports_say_and_random_numbers_of_seed_and_frame(
    panda, q_observe, scene, monkeypatch, given
):
    handed = []
    monkeypatch.setattr(push_planner, "plan_push", lambda *arguments: handed.append(arguments) or UNDECIDED)
    pair, above = scene
    parameters = PushPlanningParameters(FindActionParameters(paths=3))
    found, tried = NOTHING + 1, (TriedPush(np.zeros(3), np.zeros(2), True),)
    planner = PushPlanner(panda, parameters, 8) if given else PushPlanner(panda)
    context = planner.CreateDefaultContext()
    values = {"pair": pair, "above_table": above, "mask": NOTHING}
    for name, value in {**values, **({"tried_pushes": tried, "found": found} if given else {})}.items():
        planner.GetInputPort(name).FixValue(context, Value[object](value))
    planner.GetInputPort("position").FixValue(context, q_observe)
    assert planner.GetOutputPort("decision").Eval(context) is UNDECIDED
    ((frame, seen, mask, q, kinematics, rng, handed_tried, handed_parameters, handed_found),) = handed
    assert frame is pair.current
    assert kinematics is panda
    for value, expected in ((seen.height, above.height), (mask, NOTHING), (q, q_observe)):
        np.testing.assert_array_equal(value, expected)
    expected = np.random.default_rng([8 if given else 0, pair.current.sequence])
    assert rng.bit_generator.state == expected.bit_generator.state
    assert [each.changed for each in handed_tried] == ([True] if given else [])
    np.testing.assert_array_equal(handed_found, found if given else None)
    assert handed_parameters == (parameters if given else PushPlanningParameters())
