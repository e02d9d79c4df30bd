from types import SimpleNamespace

import pytest

from riseg_drake.app.hardware import arm_watch
from riseg_drake.app.hardware.arm_travel import TravelError
from riseg_drake.app.hardware.arm_watch import CONTACT_MARGIN, ArmWatch
from riseg_drake.app.run.interactions import Progress
from riseg_drake.pushing.arm_path import ArmPhase
from riseg_drake.pushing.push import NO_PUSH
from riseg_drake.robot.supervisor import Cause, Mode, SafetyState

HERE = object()
"""Where the arm is."""


class Desk:
    """A watch with an arm, an operator and a diagram that say what the test wants."""

    def __init__(self, monkeypatch, answer=None):
        self.now, self.answer, self.push, self.doing = 50.0, answer, NO_PUSH, ArmPhase.OBSERVE
        self.told, self.contacts, self.releases, self.words = [], [], [], 0
        self.off_path, self.way, self.planned_from = 0.0, 3.0, None
        self.driver_says = ""
        self.progress = Progress()
        self.report = SimpleNamespace(state=SafetyState(Mode.FOLLOWING), refused="")
        monkeypatch.setattr(arm_watch.time, "monotonic", lambda: self.now)
        self.watch = ArmWatch(self, self, self, self, self.progress, self, off_path=0.02)

    # the diagram
    def read(self, name, context):
        return self.push

    def phase(self, context):
        return self.doing

    def get_time(self):
        return 1000.0

    # the operator
    def released(self, stop):
        self.told.append(stop)
        return self.answer

    def tell(self, text):
        self.told.append(text)

    # the process that sends commands
    def release(self, anew=False):
        self.releases.append(anew)
        self.words += 1

    # the way back
    def plan(self, q):
        self.planned_from = q
        if self.way is None:
            raise TravelError("guide the arm by hand to nearer to it")
        return self.way

    def expect_contact(self, start, end):
        self.contacts.append((start, end))

    def look(self, mode=Mode.FOLLOWING, cause=Cause.NONE, refused="", words=None):
        self.now += ArmWatch.PERIOD
        self.report = SimpleNamespace(
            state=SafetyState(mode, cause),
            refused=refused,
            words=self.words if words is None else words,
            off_path=self.off_path,
            status=SimpleNamespace(position=HERE),
        )
        return self.watch(self)


def test_all_is_well_goes_on(monkeypatch):
    desk = Desk(monkeypatch)
    assert not desk.look()
    assert not desk.told


@pytest.mark.parametrize(
    ("answer", "releases", "ends"), [(None, [], False), (True, [False], False), (False, [], True)]
)
def test_a_stop_goes_on_at_the_operators_word_only(monkeypatch, answer, releases, ends):
    desk = Desk(monkeypatch, answer)
    assert desk.look(Mode.STOPPED, Cause.FORCE) is ends
    assert desk.releases == releases
    assert Cause.FORCE.value in desk.told[0]
    assert (Cause.FORCE.value in desk.progress.end) is ends


@pytest.mark.parametrize("answer", [None, False])
def test_what_the_driver_says_about_a_stop_is_part_of_the_question_and_of_the_end(monkeypatch, answer):
    desk = Desk(monkeypatch, answer)
    desk.driver_says = "the robot takes no commands: joint_reflex"
    desk.look(Mode.STOPPED, Cause.REFLEX)
    line = f"the arm is stopped: the arm stopped by reflex; its driver says: {desk.driver_says}"
    assert desk.told == [line]
    assert desk.progress.end == ("" if answer is None else line.replace("is stopped", "was stopped"))


@pytest.mark.parametrize(
    ("mode", "cause", "refused"),
    [(Mode.ENDED, Cause.INTERRUPT, ""), (Mode.FOLLOWING, Cause.NONE, "targets of more than 120 s are waiting")],
)
def test_a_stream_that_has_ended_or_refuses_targets_is_the_end_of_the_run(monkeypatch, mode, cause, refused):
    desk = Desk(monkeypatch)
    assert desk.look(mode, cause, refused)
    assert desk.progress.end == (refused or cause.value)


def test_a_pause_needs_no_answer_and_is_not_told_again_soon(monkeypatch):
    desk = Desk(monkeypatch)
    for cause in (Cause.IMAGES_OLD, Cause.IMAGES_OLD, Cause.STATUS_OLD):
        for _ in range(3):
            assert not desk.look(Mode.PAUSED, cause)
        desk.look()
    for told, cause in zip(desk.told, (Cause.IMAGES_OLD, Cause.STATUS_OLD), strict=True):
        assert told.startswith(f"paused: {cause.value}")
    assert "started again" in desk.told[1]
    assert desk.watch.pauses == 3
    desk.now += ArmWatch.QUIET
    desk.look(Mode.PAUSED, Cause.IMAGES_OLD)
    assert len(desk.told) == 3


def test_a_driver_that_ends_amid_a_pause_is_told_and_the_pause_counts_once(monkeypatch):
    desk = Desk(monkeypatch)
    for cause in (Cause.IMAGES_OLD, Cause.STATUS_OLD, Cause.IMAGES_OLD, Cause.STATUS_OLD):
        assert not desk.look(Mode.PAUSED, cause)
    assert [line.split(";")[0] for line in desk.told] == [
        f"paused: {cause.value}" for cause in (Cause.IMAGES_OLD, Cause.STATUS_OLD)
    ]
    assert desk.watch.pauses == 1


def test_contact_is_announced_once_and_for_the_push_alone(monkeypatch):
    desk = Desk(monkeypatch)
    path = SimpleNamespace(push_start=3.0, push_end=5.0)
    desk.push = SimpleNamespace(path=path)
    desk.look()
    assert not desk.contacts  # proposed, but not permitted yet
    for desk.doing in (ArmPhase.APPROACH, ArmPhase.PUSH):
        desk.look()
    assert desk.contacts == [(1003.0 - CONTACT_MARGIN, 1005.0 + CONTACT_MARGIN)]


def test_an_arm_that_is_off_its_path_goes_back_from_where_it_is_and_says_so(monkeypatch):
    desk = Desk(monkeypatch, answer=True)
    desk.off_path = 0.3
    desk.look(Mode.STOPPED, Cause.STATUS_ENDED)
    assert desk.planned_from is HERE
    assert desk.releases == [True]
    assert "0.30 rad off its path" in desk.told[-1]
    assert "in 3.0 s" in desk.told[-1]


def test_an_arm_that_is_near_its_path_goes_on_with_it(monkeypatch):
    desk = Desk(monkeypatch, answer=True)
    desk.off_path = 0.019
    desk.look(Mode.STOPPED, Cause.STATUS_ENDED)
    assert desk.releases == [False]
    assert desk.planned_from is None


def test_without_a_free_way_it_stays_stopped_and_asks_to_be_guided(monkeypatch):
    desk = Desk(monkeypatch, answer=True)
    desk.off_path, desk.way = 0.3, None
    assert not desk.look(Mode.STOPPED, Cause.STATUS_ENDED)
    assert desk.releases == []
    assert "stays stopped" in desk.told[-1]
    assert "guide the arm" in desk.told[-1]
    desk.way = 2.0  # it was guided
    desk.look(Mode.STOPPED, Cause.STATUS_ENDED)
    assert desk.releases == [True]


def test_a_report_of_before_the_operators_word_is_no_new_question(monkeypatch):
    desk = Desk(monkeypatch, answer=True)
    desk.look(Mode.STOPPED, Cause.FORCE)
    told = len(desk.told)
    desk.look(Mode.STOPPED, Cause.FORCE, words=0)
    assert len(desk.told) == told
    assert len(desk.releases) == 1
    desk.look(Mode.STOPPED, Cause.FORCE, words=1)  # it was heard, and the arm is stopped again
    assert len(desk.releases) == 2
