"""Ctrl-C, kill and the end of a parent: heard once, never lost, and never a traceback."""

import os
import signal
import subprocess
import sys
import time

import pytest

from riseg_drake.app.cli import main
from riseg_drake.host.processes import STOP_SIGNALS, stopped_by_signals, undisturbed

STOPPED_WHILE_IMPORTING = """
import os, signal, sys

class Pydrake:
    def find_spec(self, name, path=None, target=None):
        if name.startswith("pydrake"):
            try:
                os.kill(os.getpid(), signal.{name})
                for _ in range(1000): pass  # here the signal is heard
            except KeyboardInterrupt:  # as modules of C++ do
                raise ImportError("initialization failed")

sys.meta_path.insert(0, Pydrake())
from riseg_drake.__main__ import program
sys.argv = ["riseg", "run"]
raise SystemExit(program())
"""
CHILD = """
import os, sys, time
from riseg_drake.host.processes import end_with_parent
if os.fork() == 0:
    end_with_parent(int(os.getppid()))
    print(os.getpid(), flush=True)
    time.sleep(600)
time.sleep(600)
"""

DEAF_CHILD = """
import os, signal
from multiprocessing import get_context
from riseg_drake.host.processes import deaf_children

look = "import os, signal; os._exit(len({2, 15} & signal.pthread_sigmask(signal.SIG_BLOCK, ())))"
child = get_context("spawn").Process(target=exec, args=(look,))
with deaf_children():
    child.start()
child.join()
print(child.exitcode, len({2, 15} & signal.pthread_sigmask(signal.SIG_BLOCK, ())))
"""


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_ctrl_c_while_drake_is_imported_is_one_line_and_its_own_exit_code(name, code):
    words = [sys.executable, "-c", STOPPED_WHILE_IMPORTING.format(name=name)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (code, "riseg: stopped\n")


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_every_stop_signal_is_heard_as_ctrl_c(monkeypatch, capsys, number, code):
    monkeypatch.setattr(
        "riseg_drake.app.commands.diagram", lambda *_: os.kill(os.getpid(), number) or time.sleep(9)
    )
    # One that was ignored stays ignored, as SIGHUP is where the tests themselves were started with nohup.
    ignored = signal.getsignal(number) is signal.SIG_IGN
    outside = signal.signal(number, signal.SIG_DFL) if ignored else signal.getsignal(number)
    try:
        before = [signal.getsignal(each) for each in STOP_SIGNALS]
        assert main(["diagram"]) == code
        assert capsys.readouterr().err == "riseg: stopped\n"
        assert [signal.getsignal(each) for each in STOP_SIGNALS] == before
    finally:
        signal.signal(number, outside)


STOPPED_WHILE_A_MISTAKE_IS_TOLD = """
import os, signal, sys
from riseg_drake.app import commands
from riseg_drake.__main__ import program

def mistaken(*_):
    sys.meta_path.insert(0, Interrupting())
    raise ValueError("mine")

class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name.startswith("riseg_drake.app.emulate"):
            os.kill(os.getpid(), signal.SIGINT)
            for _ in range(1000): pass  # here the signal is heard

commands.diagram = mistaken
sys.argv = ["riseg", "diagram"]
raise SystemExit(program())
"""


def test_ctrl_c_while_it_is_found_out_whether_an_error_is_a_mistake_is_one_line_too():
    words = [sys.executable, "-c", STOPPED_WHILE_A_MISTAKE_IS_TOLD]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "riseg: stopped\n")


def test_what_a_library_makes_of_ctrl_c_is_still_ctrl_c(monkeypatch, capsys):
    def translated(*_):
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(9)
        except KeyboardInterrupt:
            raise RuntimeError("initialization failed") from None

    monkeypatch.setattr("riseg_drake.app.commands.diagram", translated)
    assert main(["diagram"]) == 130
    assert capsys.readouterr().err == "riseg: stopped\n"


def test_ctrl_c_waits_until_what_must_not_be_disturbed_is_done():
    done = []

    def write():
        with undisturbed():
            os.kill(os.getpid(), signal.SIGINT)
            done.append("whole")
        done.append("never")

    with stopped_by_signals("") as stop, pytest.raises(KeyboardInterrupt):
        write()
    assert done == ["whole"]
    assert stop.exit_code == 130


ENDED_AT_ONCE = """
import os, signal, sys
from riseg_drake.host.processes import ended_at_once, stopped_by_signals
with stopped_by_signals("") as stop:
    try:
        with ended_at_once():
            if sys.argv[1] == "within":
                os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)
    except KeyboardInterrupt:
        print("heard")
"""


@pytest.mark.parametrize(("when", "code", "out"), [("within", -signal.SIGINT, ""), ("after", 0, "heard\n")])
def test_around_what_hears_no_signal_the_process_ends_at_once_and_after_it_as_ever(when, code, out):
    done = subprocess.run(
        [sys.executable, "-c", ENDED_AT_ONCE, when], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (code, out, "")


def test_what_is_ignored_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    try:
        with stopped_by_signals(""):
            os.kill(os.getpid(), signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_child_begins_deaf_to_both_signals_and_its_parent_is_not():
    done = subprocess.run([sys.executable, "-c", DEAF_CHILD], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("2 0\n", "")


def test_a_child_ends_with_its_parent_however_that_ends():
    parent = subprocess.Popen([sys.executable, "-c", CHILD], stdout=subprocess.PIPE, text=True)
    child = int(parent.stdout.readline())
    parent.kill()
    parent.wait()
    for _ in range(1000):
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return
        with open(f"/proc/{child}/stat") as stat:
            if stat.read().rpartition(")")[2].split()[0] == "Z":
                return  # dead, and nobody has asked for its exit code
        time.sleep(0.01)
    pytest.fail("the child is still there")
