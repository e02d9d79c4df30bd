"""How long ArmMotion waits, how near is near, and how one motion fades into the next: by the numbers."""

from dataclasses import fields, replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.trajectories import PiecewisePolynomial

from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.decision import Decision, Ending
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.systems.arm_motion import ArmMotion, ArmMotionParameters
from tests.systems.ports import port_names
from tests.systems.scripted_eyes import (
    CAMERA,
    NOTHING_LEFT,
    Q_OBSERVE,
    SECONDS,
    THERE,
    Script,
    push_to,
    run,
    show_still,
    wired,
)

LOOK = 1 / 30


def test_ports_have_the_names_of_the_contract():
    assert port_names(ArmMotion(Q_OBSERVE)) == (
        ["decision", "pair", "mask", "decided", "position_measured"],
        ["position", "phase", "interaction_step", "active_push", "tried_pushes", "last_decision"],
    )


def test_as_in_the_paper_there_are_up_to_five_interactions():
    (most,) = (field for field in fields(ArmMotionParameters) if field.name == "most_interactions")
    assert ArmMotionParameters().most_interactions == 5
    assert dict(most.metadata) == {"least": 0, "most": 1000}


def test_it_looks_thirty_times_a_second():
    looks = []
    motion = ArmMotion(Q_OBSERVE, way_back=lambda: looks.append(1))
    simulator = Simulator(motion)
    motion.GetInputPort("position_measured").FixValue(simulator.get_mutable_context(), Q_OBSERVE + 1)
    simulator.AdvanceTo(2.0 - LOOK / 2)
    assert len(looks) == 60


def test_a_push_is_chosen_in_the_first_frame_a_quarter_of_a_second_after_the_arm_came_to_rest():
    script = Script([push_to(THERE)])
    run(script, 1.0)
    _, frame_time = script.asked[0]
    assert frame_time == pytest.approx(4 * SECONDS)  # of 15 a second; it is at rest from the first look on


@pytest.mark.parametrize(
    ("joint", "off", "rests"),
    [(0, 0.0099, True), (3, -0.0101, False), (6, 0.0101, False)],
)
def test_an_arm_rests_where_every_joint_is_within_a_hundredth_rad(joint, off, rests):
    motion = ArmMotion(Q_OBSERVE)
    simulator = Simulator(motion)
    context = simulator.get_mutable_context()
    show_still(motion, context, time=1.0)
    measured = Q_OBSERVE.copy()
    measured[joint] += off
    motion.GetInputPort("position_measured").FixValue(context, measured)
    simulator.AdvanceTo(0.5)
    assert (motion.GetOutputPort("active_push").Eval(context) is not NO_PUSH) is rests


def test_an_arm_that_was_moved_meanwhile_rests_anew():
    motion = ArmMotion(Q_OBSERVE)
    simulator = Simulator(motion)
    context = simulator.get_mutable_context()

    def show(until, measured, time=-1.0):
        show_still(motion, context, time)
        motion.GetInputPort("position_measured").FixValue(context, measured)
        simulator.AdvanceTo(until)
        return motion.GetOutputPort("active_push").Eval(context)

    show(0.11, Q_OBSERVE)
    show(0.21, Q_OBSERVE + 0.1)
    show(0.31, Q_OBSERVE)  # at rest again since the look at 7/30 s
    assert show(0.61, Q_OBSERVE, time=7 / 30 + 0.249) is NO_PUSH
    assert show(0.71, Q_OBSERVE, time=7 / 30 + 0.251) is not NO_PUSH


def test_frames_without_a_push_count_only_in_a_row():
    script = Script([push_to(THERE)], vain_looks=1)
    phases, motion, context, _ = run(script, 6.0)
    assert motion.GetOutputPort("interaction_step").Eval(context) == 1
    assert phases[-1] is ArmPhase.DONE
    assert len(script.asked) == 4  # in vain, the push, and in vain twice


@pytest.mark.parametrize(("frames", "asked"), [(1, 1), (3, 3)])
def test_how_many_frames_without_a_push_end_it_can_be_said(frames, asked):
    script = Script([])
    phases, _, _, _ = run(script, 2.0, ArmMotionParameters(null_frames=frames))
    assert phases[-1] is ArmPhase.DONE
    assert len(script.asked) == asked


@pytest.mark.parametrize(
    ("ids", "pixels", "area", "changed"),
    [
        ([3, 3], [4, 5], 2.9e-4, False),
        ([3, 3], [4, 5], 3.1e-4, True),
        ([3, 3], [5, 4], 3.1e-4, True),
        ([0, 3], [16, 1], 1e-6, True),
        ([3, 4], [4, 4], 1.0, False),
    ],
    ids=["a little more", "more", "less", "the first object, a small one", "another id"],
)
def test_a_push_brought_something_if_3_square_centimetres_more_or_another_number_of_objects_are_segmented(
    ids, pixels, area, changed
):
    depth = np.sqrt(area * CAMERA.fx * CAMERA.fy)  # at which a pixel covers that area, m^2
    script = Script([push_to(THERE)], ids_after=ids, pixels_after=pixels, depth=depth)
    _, motion, context, _ = run(script, 6.0)
    (tried,) = motion.GetOutputPort("tried_pushes").Eval(context)
    assert tried.changed is changed


class Joined:
    """A push whose path begins 0.02 rad beside the observation posture, and the command beside the path."""

    def __init__(self, offset: float = 0.02, **parameters) -> None:
        self.push = push_to(THERE, start_offset=offset)
        script = Script([self.push])
        diagram, self.motion, _ = wired(script, ArmMotionParameters(**parameters))
        self.simulator = Simulator(diagram)
        self.context = self.motion.GetMyContextFromRoot(self.simulator.get_context())
        self.simulator.AdvanceTo(0.3)
        self.start = script.asked[0][0]

    def beside(self, since: float):
        """The command less the path, so long after the start."""
        self.simulator.AdvanceTo(self.start + since)
        command = self.motion.GetOutputPort("position").Eval(self.context)
        return command - self.push.path.position(since)


def test_what_a_path_begins_beside_is_faded_out_and_in_over_half_a_second():
    joined, offset = Joined(), np.full(7, -0.02)
    duration = joined.push.path.duration
    # Minimum jerk: 10 s^3 - 15 s^4 + 6 s^5 of the way is 106/1024 after a quarter, a half after a half.
    for since, share in ((0.125, 1 - 106 / 1024), (0.25, 0.5), (0.375, 106 / 1024), (0.5, 0)):
        np.testing.assert_allclose(joined.beside(since), share * offset, atol=1e-9)
    for left, share in ((0.5, 0), (0.375, 106 / 1024), (0.25, 0.5), (0.125, 1 - 106 / 1024)):
        np.testing.assert_allclose(joined.beside(duration - left), share * offset, atol=1e-9)


@pytest.mark.parametrize(
    ("offset", "refused"), [(0.049, False), (-0.049, False), (0.051, True), (-0.051, True)]
)
def test_a_path_may_begin_a_twentieth_rad_away_and_no_further(offset, refused):
    if refused:
        with pytest.raises(ValueError, match=r"begins 0\.051 rad away .* at most 0\.05 is allowed"):
            Joined(offset)
    else:
        np.testing.assert_allclose(Joined(offset).beside(0.5), 0, atol=1e-9)


def test_a_push_without_a_path_is_refused():
    with pytest.raises(ValueError, match="the push has no path"):
        run(Script([replace(push_to(THERE), path=None)]), 1.0)


def test_on_the_way_back_it_follows_it_from_the_look_on_and_stays_at_its_end():
    way = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.stack([THERE, Q_OBSERVE], axis=1))
    ways = iter([None, None, None, way])
    diagram, motion, _ = wired(Script([]), way_back=lambda: next(ways, None))
    simulator = Simulator(diagram)
    context = motion.GetMyContextFromRoot(simulator.get_context())
    for since, share in ((0.25, 0.25), (0.75, 0.75), (1.0, 1.0), (1.01, 1.0)):
        simulator.AdvanceTo(3 * LOOK + since)
        command = motion.GetOutputPort("position").Eval(context)
        np.testing.assert_allclose(command, THERE + share * (Q_OBSERVE - THERE), atol=1e-9)
        assert motion.GetOutputPort("phase").Eval(context) is ArmPhase.OBSERVE
    assert motion.GetOutputPort("interaction_step").Eval(context) == 0


def test_once_enough_was_pushed_the_decision_keeps_no_push_and_no_reasons():
    left = Decision(push_to(THERE), unsettled_area=0.01, candidates=7, failed={"too near": 3})
    script = Script([], null=left)
    _, motion, context, _ = run(script, 1.0, ArmMotionParameters(most_interactions=0))
    last = motion.GetOutputPort("last_decision").Eval(context)
    assert (last.push, last.ending) == (NO_PUSH, Ending.ENOUGH_INTERACTIONS)
    assert (last.candidates, last.failed, last.unsettled_area) == (0, {}, 0.01)
    assert motion.GetOutputPort("interaction_step").Eval(context) == 0


def test_with_no_interaction_allowed_it_looks_once_and_is_done():
    script = Script([push_to(THERE)], null=NOTHING_LEFT)
    phases, motion, context, _ = run(script, 1.0, ArmMotionParameters(most_interactions=0))
    assert phases == [ArmPhase.OBSERVE, ArmPhase.DONE]
    assert len(script.asked) == 1
    np.testing.assert_array_equal(motion.GetOutputPort("position").Eval(context), Q_OBSERVE)
