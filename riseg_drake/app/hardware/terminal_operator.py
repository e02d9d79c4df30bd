"""The person at the terminal: asked before the arm moves, and after it has stopped."""

import queue
import sys
import threading
import time
from typing import TextIO

from rich.console import Console

from riseg_drake.app.work_state import RunStoppedError
from riseg_drake.pushing.push import Push
from riseg_drake.systems.arm_motion import Permission

QUIT = "q"


class TerminalOperator:
    """Asks in the terminal without waiting: who has asked looks for the answer now and then.

    With `consents` (for `--yes`) pushes are permitted unasked; a stop is never released that way.
    Where the terminal is closed, every answer is to quit.
    """

    def __init__(self, console: Console, consents: bool, terminal: TextIO | None = None):
        self._console = console
        self._consents = consents
        self._terminal = terminal or sys.stdin
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._question = ""
        self._reader: threading.Thread | None = None
        self._closed = False

    def answer(self, question: str, choices: str) -> str:
        """One of the letters in `choices`, or "" while there is no answer; the question is printed once."""
        if question != self._question:
            self._question = question
            self._start_reading()
            while not self._lines.empty():  # typed before it was asked: meant for something else
                self._lines.get()
            self._console.print(question, highlight=False)
        try:
            said = self._lines.get_nowait()
        except queue.Empty:
            return QUIT if self._closed else ""
        if said not in choices.split():
            self._console.print(f"please answer one of {choices}, and press Enter")
            return ""
        self._question = ""
        return said

    @property
    def why_quit(self) -> str:
        """What stands behind an answer to quit, for people."""
        if self._closed:
            return "nobody can answer: there is no terminal to read from; with --yes nobody is asked"
        return "the operator ended it"

    def permit(self, push: Push) -> Permission:
        """What the operator says to a push."""
        if self._consents:
            return Permission.DO
        x, y = push.p_WB[:2]
        said = self.answer(
            f"push at ({x:.3f}, {y:.3f}) m by {100 * push.d_push:.0f} cm towards "
            f"({push.direction_W[0]:+.2f}, {push.direction_W[1]:+.2f}){with_which_side(push)}, "
            f"tip at z = {push.p_WE[2]:.3f} m: y to do it, n for another, q to end",
            f"y n {QUIT}",
        )
        return {"": Permission.WAIT, "y": Permission.DO, "n": Permission.SKIP}.get(said, Permission.END)

    def confirm(self, question: str) -> None:
        """Wait for a yes. Raises KeyboardInterrupt for a no, RunStoppedError where nobody can answer."""
        if self._consents:
            self._console.print(question, highlight=False)
            return
        while not (said := self.answer(f"{question}: y to go, q to end", f"y {QUIT}")):
            time.sleep(0.05)
        if said == "y":
            return
        if self._closed:
            raise RunStoppedError(self.why_quit)
        raise KeyboardInterrupt

    def released(self, stop: str) -> bool | None:
        """Whether the arm may move again after a stop; None while there is no answer.

        Who consented to pushes in advance did not consent to this.
        """
        if self._consents:
            self._console.print(stop, highlight=False)
            return False
        said = self.answer(f"{stop}: g to go on once that is mended, q to end", f"g {QUIT}")
        return None if not said else said == "g"

    def wait_for_enter(self) -> None:
        """Wait for one more line, or for the end of them."""
        self._start_reading()
        while not self._lines.empty():
            self._lines.get()
        while self._lines.empty() and not self._closed:
            time.sleep(0.05)

    def tell(self, text: str) -> None:
        """Say something that needs no answer."""
        self._console.print(text, highlight=False)

    def _start_reading(self) -> None:
        if self._reader is None:
            self._reader = threading.Thread(target=self._read, name="terminal", daemon=True)
            self._reader.start()

    def _read(self) -> None:
        for line in self._terminal:
            self._lines.put(line.strip().lower())
        self._closed = True


def with_which_side(push: Push) -> str:
    """What the operator is told where the tool, and the camera on it, will turn around."""
    return " with the back of the tool" if push.turned else ""
