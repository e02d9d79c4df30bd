from types import SimpleNamespace

import pytest

from riseg_drake.app import arm_watch
from riseg_drake.app.arm_watch import CONTACT_MARGIN, ArmWatch
from riseg_drake.app.interactions import Progress
from riseg_drake.pushing.push import NO_PUSH, ArmPhase
from riseg_drake.robot.supervisor import Cause, Mode, SafetyState


class Desk:
    """A watch with an arm, an operator and a diagram that say what the test wants."""

    def __init__(self, monkeypatch, answer=None):
        self.now, self.answer, self.push, self.doing = 50.0, answer, NO_PUSH, ArmPhase.OBSERVE
        self.told, self.contacts, self.releases = [], [], 0
        self.progress = Progress()
        self.report = SimpleNamespace(state=SafetyState(Mode.FOLLOWING), refused="")
        monkeypatch.setattr(arm_watch.time, "monotonic", lambda: self.now)
        self.watch = ArmWatch(self, self, self, self.progress)

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
    def release(self):
        self.releases += 1

    def expect_contact(self, start, end):
        self.contacts.append((start, end))

    def look(self, mode=Mode.FOLLOWING, cause=Cause.NONE, refused=""):
        self.now += ArmWatch.PERIOD
        self.report = SimpleNamespace(state=SafetyState(mode, cause), refused=refused)
        return self.watch(self)


def test_all_is_well_goes_on(monkeypatch):
    desk = Desk(monkeypatch)
    assert not desk.look()
    assert not desk.told


@pytest.mark.parametrize(("answer", "releases", "ends"), [(None, 0, False), (True, 1, False), (False, 0, True)])
def test_a_stop_goes_on_at_the_operators_word_only(monkeypatch, answer, releases, ends):
    desk = Desk(monkeypatch, answer)
    assert desk.look(Mode.STOPPED, Cause.FORCE) is ends
    assert desk.releases == releases
    assert Cause.FORCE.value in desk.told[0]
    assert (Cause.FORCE.value in desk.progress.end) is ends


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
    assert desk.told == [f"paused: {cause.value}" for cause in (Cause.IMAGES_OLD, Cause.STATUS_OLD)]
    assert desk.watch.pauses == 3
    desk.now += ArmWatch.QUIET
    desk.look(Mode.PAUSED, Cause.IMAGES_OLD)
    assert len(desk.told) == 3


def test_contact_is_announced_once_and_for_the_push_alone(monkeypatch):
    desk = Desk(monkeypatch)
    path = SimpleNamespace(push_start=3.0, push_end=5.0)
    desk.push = SimpleNamespace(path=path)
    desk.look()
    assert not desk.contacts  # proposed, but not permitted yet
    for desk.doing in (ArmPhase.APPROACH, ArmPhase.PUSH):
        desk.look()
    assert desk.contacts == [(1003.0 - CONTACT_MARGIN, 1005.0 + CONTACT_MARGIN)]
