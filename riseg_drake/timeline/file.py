"""The file that a time line goes to, and the viewer that shows it as it grows."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from riseg_drake.timeline.blueprint import blueprint

ENDING = ".rrd"
_MAGIC = b"RRF"
"""What Rerun's files begin with."""


class TimelineError(ValueError):
    """Why there can be no time line, in one line for the person who asked for it."""


def check_timeline(file: Path) -> None:
    """Raise TimelineError unless Rerun is installed, and can write to this file without harm."""
    if file.suffix != ENDING:
        raise TimelineError(
            f"--rerun {file}: Rerun's files end in {ENDING}; what is to be read comes before --rerun"
        )
    try:
        import rerun
    except ImportError as error:
        raise TimelineError(f"--rerun needs rerun-sdk ({error}): pip install 'riseg-drake[rerun]'") from None
    del rerun
    if file.is_dir():
        raise TimelineError(f"--rerun {file}: that is a folder; give a file that ends in {ENDING}")
    if file.exists():
        with file.open("rb") as there:
            if there.read(len(_MAGIC)) not in (_MAGIC, b""):
                raise TimelineError(f"--rerun {file}: there is a file of another kind; give another name")


def has_display() -> bool:
    """Whether a window can be opened here."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


@contextmanager
def timeline_stream(file: Path, name: str, *, live: bool) -> Iterator[Any]:
    """A `rerun.RecordingStream` into a file, and where `live` into a viewer that is opened, too.

    The file is whole once the block is left, however that comes. Raises OSError where it cannot be written.
    """
    import rerun

    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("wb"):  # says why it cannot be written, which the stream's own thread would keep to itself
        pass
    stream = rerun.RecordingStream("riseg")
    stream.send_recording_name(name)
    layout = blueprint()
    sinks: list[Any] = [rerun.FileSink(str(file))]
    if live:
        rerun.spawn(connect=False, recording=stream)
        sinks.append(rerun.GrpcSink())
    stream.set_sinks(*sinks, default_blueprint=layout)
    try:
        yield stream
    finally:
        stream.flush()
        stream.disconnect()
