"""ArmMotion through its ports, with a stand-in for everything that sees."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.decision import Decision, Ending
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.pushing.time_law import SpeedLimits, minimum_jerk, rest_to_rest
from riseg_drake.robot.limits import PANDA_LIMITS
from riseg_drake.systems.arm_motion import ArmMotion, ArmMotionParameters, Permission
from tests.systems.scripted_eyes import (
    NOTHING_LEFT,
    Q_OBSERVE,
    THERE,
    Eyes,
    Script,
    push_to,
    run,
    show_still,
)


def test_phases_come_in_their_order_and_null_ends_them():
    phases, motion, context, _ = run(Script([push_to(THERE), push_to(THERE, at=0.1)]), 12.0)
    once = [ArmPhase.APPROACH, ArmPhase.PUSH, ArmPhase.RETREAT, ArmPhase.OBSERVE]
    assert phases == [ArmPhase.OBSERVE, *once, *once, ArmPhase.DONE]
    assert motion.GetOutputPort("interaction_step").Eval(context) == 2
    assert motion.GetOutputPort("active_push").Eval(context) is NO_PUSH


def test_nothing_to_push_is_done_after_looking_twice():
    script = Script([])
    phases, _, _, _ = run(script, 2.0)
    assert phases == [ArmPhase.OBSERVE, ArmPhase.DONE]
    assert len({frame_time for _, frame_time in script.asked}) == len(script.asked) == 2


def test_command_goes_from_the_observation_posture_and_back_without_a_jump():
    _, _, _, log = run(Script([push_to(THERE)]), 6.0)
    q, time = log.data(), log.sample_times()
    velocity = np.diff(q) / np.diff(time)
    assert q[:, 0] == pytest.approx(Q_OBSERVE)
    assert q[:, -1] == pytest.approx(Q_OBSERVE)
    assert np.abs(q - THERE[:, None]).max(axis=0).min() < 1e-3
    assert np.abs(velocity).max() < 1.6
    assert np.abs(np.diff(velocity)).max() / 0.002 < 10.0


def test_path_planned_from_a_little_beside_the_command_is_joined_smoothly():
    _, _, _, log = run(Script([push_to(THERE, start_offset=0.01)]), 2.0)
    velocity = np.diff(log.data()) / np.diff(log.sample_times())
    assert np.abs(np.diff(velocity)).max() / 0.002 < 10.0


def test_path_that_begins_elsewhere_is_refused():
    with pytest.raises(ValueError, match="begins 0\\.3"):
        run(Script([push_to(THERE, start_offset=0.3)]), 2.0)


def test_push_is_asked_for_only_in_frames_taken_after_the_arm_came_to_rest():
    script = Script([push_to(THERE), push_to(THERE, at=0.1)])
    parameters = ArmMotionParameters(settle_time=0.3)
    _, _, _, log = run(script, 12.0, parameters)
    time, moving = log.sample_times()[1:], (np.abs(np.diff(log.data())) > 1e-9).any(axis=0)
    for asked, frame_time in script.asked:
        before = time[moving & (time < asked - 1e-6)]
        assert frame_time >= 0.3 - 1e-9
        assert len(before) == 0 or frame_time >= before[-1] + 0.3 - 0.01
    assert len(script.asked) == 4  # two pushes, and null twice


@pytest.mark.parametrize(("until", "asked_from"), [(1.0, 1.0), (99.0, 2.0)])
def test_no_push_is_chosen_while_the_scene_moves_unless_it_does_so_for_long(until, asked_from):
    script = Script([push_to(THERE)], undecided=(0.0, until))
    run(script, 4.0)
    first, _ = script.asked[0]
    assert asked_from <= first < asked_from + 0.15


def test_without_a_word_on_rest_every_mask_counts():
    motion = ArmMotion(Q_OBSERVE)
    simulator = Simulator(motion)
    context = simulator.get_mutable_context()
    show_still(motion, context, time=0.4)
    motion.GetInputPort("position_measured").FixValue(context, Q_OBSERVE)
    simulator.AdvanceTo(0.5)
    assert motion.GetOutputPort("active_push").Eval(context) is not NO_PUSH


def test_most_interactions_end_the_run():
    script = Script([push_to(THERE)] * 9)
    phases, motion, context, _ = run(script, 8.0, ArmMotionParameters(most_interactions=1))
    assert phases[-1] is ArmPhase.DONE
    assert motion.GetOutputPort("interaction_step").Eval(context) == 1
    assert len(script.asked) == 2  # the second time to know what is left


@pytest.mark.parametrize(
    ("null", "most", "ending", "area"),
    [
        (Decision(ending=Ending.NO_PATH, unsettled_area=0.004), 5, Ending.NO_PATH, 0.004),
        (Decision(ending=Ending.NOTHING_VALID, unsettled_area=0.004), 5, Ending.NOTHING_VALID, 0.004),
        (NOTHING_LEFT, 5, Ending.NOTHING_LEFT, 0.0),
        (Decision(ending=Ending.NOTHING_VALID, unsettled_area=0.004), 1, Ending.ENOUGH_INTERACTIONS, 0.004),
        (NOTHING_LEFT, 1, Ending.NOTHING_LEFT, 0.0),
    ],
    ids=["no path", "nothing valid", "nothing left", "enough", "nothing left after enough"],
)
def test_the_last_decision_says_why_the_arm_is_done(null, most, ending, area):
    script = Script([push_to(THERE)], null)
    phases, motion, context, _ = run(script, 8.0, ArmMotionParameters(most_interactions=most))
    assert phases[-1] is ArmPhase.DONE
    last = motion.GetOutputPort("last_decision").Eval(context)
    assert (last.push, last.ending, last.unsettled_area) == (NO_PUSH, ending, area)


def test_where_pushes_are_used_up_with_something_left_that_is_the_reason():
    phases, motion, context, _ = run(
        Script([push_to(THERE)] * 9), 8.0, ArmMotionParameters(most_interactions=1)
    )
    assert phases[-1] is ArmPhase.DONE
    last = motion.GetOutputPort("last_decision").Eval(context)
    assert (last.push, last.ending, last.unsettled_area) == (NO_PUSH, Ending.ENOUGH_INTERACTIONS, 0.01)


def test_push_is_remembered_with_whether_it_changed_the_mask():
    script = Script([push_to(THERE), push_to(THERE, at=0.1)], ids_after=[0, 3, 3])
    _, motion, context, _ = run(script, 12.0)
    tried = motion.GetOutputPort("tried_pushes").Eval(context)
    assert [push.changed for push in tried] == [True, False]
    assert tried[1].p_WB == pytest.approx([0.6, 0.0, 0.02])


def test_arm_that_is_not_where_it_should_be_is_waited_for():
    motion = ArmMotion(Q_OBSERVE)
    context = motion.CreateDefaultContext()
    motion.GetInputPort("position_measured").FixValue(context, Q_OBSERVE + 0.1)
    simulator = Simulator(motion, context)
    simulator.AdvanceTo(2.0)  # neither pair nor push is connected: asking would throw
    assert motion.GetOutputPort("phase").Eval(context) is ArmPhase.OBSERVE


def test_no_output_depends_on_an_input_at_the_same_moment():
    motion = ArmMotion(Q_OBSERVE)
    assert not motion.HasAnyDirectFeedthrough()


def run_permitted(script, until, permit):
    """Whether and when the arm moved, with a permit; interactions made, and pushes tried."""
    builder = DiagramBuilder()
    motion = builder.AddSystem(ArmMotion(Q_OBSERVE, None, permit))
    eyes = builder.AddSystem(Eyes(script))
    for name in ("pair", "mask", "decision"):
        builder.Connect(eyes.GetOutputPort(name), motion.GetInputPort(name))
    builder.Connect(motion.GetOutputPort("interaction_step"), eyes.GetInputPort("interaction_step"))
    builder.Connect(motion.GetOutputPort("position"), motion.GetInputPort("position_measured"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(until)
    context = motion.GetMyContextFromRoot(simulator.get_context())
    return lambda name: motion.GetOutputPort(name).Eval(context)


def test_an_arm_that_is_not_permitted_to_push_stands_still_and_shows_what_it_would_do():
    push = push_to(THERE)
    read = run_permitted(Script([push]), 3.0, lambda _: Permission.WAIT)
    assert read("phase") is ArmPhase.OBSERVE
    assert read("active_push") is push
    np.testing.assert_array_equal(read("position"), Q_OBSERVE)


def test_a_push_that_is_skipped_counts_as_tried_in_vain():
    answers = iter([Permission.SKIP, Permission.WAIT, Permission.DO])
    script = Script([push_to(THERE)])
    read = run_permitted(script, 10.0, lambda _: next(answers))
    assert [push.changed for push in read("tried_pushes")] == [False, False]
    assert read("interaction_step") == 1
    assert len(script.asked) == 4  # once for each proposal, and null twice


def test_the_operator_can_end_it():
    read = run_permitted(Script([push_to(THERE)] * 9), 2.0, lambda _: Permission.END)
    assert read("phase") is ArmPhase.DONE
    assert read("interaction_step") == 0


def test_an_arm_that_has_not_set_out_yet_is_not_taken_for_one_that_is_back():
    late = [0.0]
    builder = DiagramBuilder()
    motion = builder.AddSystem(ArmMotion(Q_OBSERVE, None, None, lambda: late[0]))
    eyes = builder.AddSystem(Eyes(Script([push_to(THERE), push_to(THERE, at=0.1)])))
    for name in ("pair", "mask", "decision"):
        builder.Connect(eyes.GetOutputPort(name), motion.GetInputPort(name))
    builder.Connect(motion.GetOutputPort("interaction_step"), eyes.GetInputPort("interaction_step"))
    builder.Connect(motion.GetOutputPort("position"), motion.GetInputPort("position_measured"))
    simulator = Simulator(builder.Build())
    context = motion.GetMyContextFromRoot(simulator.get_context())
    simulator.AdvanceTo(10.0)
    assert motion.GetOutputPort("phase").Eval(context) is ArmPhase.OBSERVE
    assert motion.GetOutputPort("interaction_step").Eval(context) == 1
    assert motion.GetOutputPort("tried_pushes").Eval(context) == ()
    late[0] = 20.0
    simulator.AdvanceTo(16.0)
    assert motion.GetOutputPort("interaction_step").Eval(context) == 2


BY_HAND = THERE + np.array([-0.3, 0.1, 0.2, 0.0, 0.1, 0.0, 0.0])


def ways_back(*looks):
    """A way back from where a hand has put the arm, at these of the looks for one; whether it was taken."""
    count = iter(range(10**6))

    def way_back():
        if next(count) not in looks:
            return None
        return rest_to_rest(np.array([BY_HAND, Q_OBSERVE]), minimum_jerk, SpeedLimits(), PANDA_LIMITS)

    return way_back


def test_a_push_is_given_up_for_the_way_back_and_counts_as_one_that_is_judged():
    script = Script([push_to(THERE), push_to(THERE, at=0.1)], ids_after=[0, 3, 3])
    phases, motion, context, log = run(script, 12.0, way_back=ways_back(15))
    cut_short = [ArmPhase.APPROACH, ArmPhase.RETREAT, ArmPhase.OBSERVE]
    whole = [ArmPhase.APPROACH, ArmPhase.PUSH, ArmPhase.RETREAT, ArmPhase.OBSERVE]
    assert phases == [ArmPhase.OBSERVE, *cut_short, *whole, ArmPhase.DONE]
    assert motion.GetOutputPort("interaction_step").Eval(context) == 2
    assert [push.changed for push in motion.GetOutputPort("tried_pushes").Eval(context)] == [True, False]
    # From where the arm was put, and to the observation posture.
    jump = np.abs(np.diff(log.data())).max(axis=0).argmax()
    assert log.data()[:, jump + 1] == pytest.approx(BY_HAND, abs=1e-3)
    assert log.data()[:, -1] == pytest.approx(Q_OBSERVE)


def test_an_arm_that_only_looked_comes_back_without_an_interaction_and_asks_anew_for_a_push():
    script = Script([push_to(THERE)])
    phases, motion, context, _ = run(script, 12.0, way_back=ways_back(3))
    once = [ArmPhase.APPROACH, ArmPhase.PUSH, ArmPhase.RETREAT, ArmPhase.OBSERVE]
    assert phases == [ArmPhase.OBSERVE, *once, ArmPhase.DONE]
    assert motion.GetOutputPort("interaction_step").Eval(context) == 1
    back = rest_to_rest(np.array([BY_HAND, Q_OBSERVE]), minimum_jerk, SpeedLimits(), PANDA_LIMITS)
    assert min(asked for asked, _ in script.asked) > back.end_time()


def test_a_proposal_is_withdrawn_when_the_arm_is_led_away():
    push = push_to(THERE)
    builder = DiagramBuilder()
    motion = builder.AddSystem(ArmMotion(Q_OBSERVE, None, lambda _: Permission.WAIT, way_back=ways_back(60)))
    eyes = builder.AddSystem(Eyes(Script([push])))
    for name in ("pair", "mask", "decision"):
        builder.Connect(eyes.GetOutputPort(name), motion.GetInputPort(name))
    builder.Connect(motion.GetOutputPort("interaction_step"), eyes.GetInputPort("interaction_step"))
    builder.Connect(motion.GetOutputPort("position"), motion.GetInputPort("position_measured"))
    simulator = Simulator(builder.Build())
    context = motion.GetMyContextFromRoot(simulator.get_context())
    simulator.AdvanceTo(1.9)
    assert motion.GetOutputPort("active_push").Eval(context) is push
    simulator.AdvanceTo(2.1)
    assert motion.GetOutputPort("active_push").Eval(context) is NO_PUSH
