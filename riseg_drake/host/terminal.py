"""What a person is told: one line, whatever a file's name or a library's words hold."""

import os
import select
import sys
import warnings
from contextlib import suppress
from typing import Any

LONGEST_LINE = 600
"""Characters; of a longer one the middle is left out."""


def one_line(text: object) -> str:
    """The words of a text in one line that does nothing to a terminal; a very long one loses its middle."""
    words = " ".join(str(text).split())
    line = "".join(c if c.isprintable() else repr(c)[1:-1] for c in words)
    if len(line) <= LONGEST_LINE:
        return line
    half = (LONGEST_LINE - 5) // 2
    return f"{line[:half]} ... {line[-half:]}"


def tell_error(text: object) -> None:
    """Say on the error stream, in one line, what is wrong; silently where nobody can hear it."""
    with suppress(OSError, ValueError):
        print(f"riseg: {one_line(text)}", file=sys.stderr, flush=True)


class Notice(UserWarning):
    """What a person should know though the work goes on, in one line."""


def tell_notices() -> None:
    """Say notices as errors are said, in one line each; other warnings stay as they are."""
    show = warnings.showwarning

    def tell(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
        if issubclass(category, Notice):
            tell_error(message)
        else:
            show(message, category, *where, **more)

    warnings.showwarning = tell


def nobody_reads() -> bool:
    """Whether the reader of our output is gone; otherwise some other pipe has broken, which is a fault."""
    output = select.poll()
    output.register(sys.stdout.fileno(), 0)
    return any(events & select.POLLERR for _, events in output.poll(0))


def can_write() -> None:
    """Send on what waits to be written to the output. Raises OSError where that cannot be."""
    sys.stdout.flush()


def drop_output() -> None:
    """Write nothing more to the output: what waits for it there would be an error at the end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
