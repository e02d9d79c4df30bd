import gc
import os

import pytest

from riseg_drake.stations import promptness


@pytest.fixture
def garbage():
    yield
    gc.enable()
    gc.unfreeze()


def test_no_garbage_is_collected_and_every_thread_gets_the_priority(monkeypatch, garbage):
    told = {}
    monkeypatch.setattr(
        promptness.os, "sched_setscheduler", lambda pid, law, p: told.update({pid: (law, p.sched_priority)})
    )
    promptness.be_prompt(37)
    assert not gc.isenabled()
    assert gc.get_freeze_count() > 0
    assert set(told) == {int(name) for name in os.listdir("/proc/self/task")}
    assert set(told.values()) == {(os.SCHED_FIFO, 37)}


def test_without_the_right_to_it_the_process_goes_on(monkeypatch, garbage):
    def refuse(*asked):
        raise PermissionError("Operation not permitted")

    monkeypatch.setattr(promptness.os, "sched_setscheduler", refuse)
    promptness.be_prompt(37)
    assert not gc.isenabled()
