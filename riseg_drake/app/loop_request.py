"""What is asked of every command that acts and segments in turn: of the simulation and of the real arm."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class LoopRequest:
    """Which scenario, and what is to be kept and seen of it."""

    scenario: Path | None = None
    """A file, or None for the built-in one."""
    seed: int = 0
    output: Path | None = None
    """Folder; None: out/, and named after the scenario."""
    record: bool = False
    """Whether what the camera sees is recorded."""
    meshcat: bool = False
    """Whether it is shown in a browser; a dry run of the real arm always is."""
    wait: bool = True
    """Whether the browser's view stays until Enter, once it is over."""
    export: tuple[str, ...] = ()
    """Formats of other tools."""
    export_frames: tuple[int, ...] = ()
    """Numbers of the frames for Contact-GraspNet, from 0; the last one if there are none."""
    rerun: Path | None = None
    """File of a time line for Rerun's viewer; an empty path: in the output folder."""
