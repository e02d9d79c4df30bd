"""How a command's work ended, for the summary in its folder: done, interrupted, stopped or failed."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from riseg_drake.app.output_folder import OutputError
from riseg_drake.host.processes import undisturbed
from riseg_drake.host.terminal import one_line


class RunStoppedError(RuntimeError):
    """A run that did not come to its end; says in one line why."""


@contextmanager
def end_noted(note: Callable[[str, str], None], left: Callable[[], str]) -> Iterator[None]:
    """Enter in the summary how work ended that did not come to its end; what was raised goes on.

    A KeyboardInterrupt is raised again, with what it left.

    Args:
        note: enters a state and the reason in words.
        left: what an interrupted command says that it leaves.
    """
    try:
        yield
    except KeyboardInterrupt:
        with undisturbed():
            note("interrupted", "stopped by the user")
        raise KeyboardInterrupt(left()) from None
    except RunStoppedError as stop:
        note("stopped", str(stop))
        raise
    except Exception as error:
        with suppress(OutputError):  # where the disk is full
            note("failed", one_line(error))
        raise
