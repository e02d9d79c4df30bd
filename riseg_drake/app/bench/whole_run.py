"""`riseg bench --run`: where the time of a whole simulated run goes, room by room."""

import cProfile
import pstats
from collections.abc import Mapping
from pathlib import Path, PurePath
from time import perf_counter, process_time
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from scipy import sparse

from riseg_drake.app.diagram import make_diagram
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output_folder import to_json, write_told
from riseg_drake.app.run.command import Narrator, peak_memory_mb
from riseg_drake.app.run.interactions import Progress, interactions
from riseg_drake.app.scenario import load_scenario
from riseg_drake.systems.stage_clock import StageClock

Function = tuple[str, int, str]
"""Of a profile: file, line, name."""
Calls = tuple[int, int, float, float]
"""How often, without recursion and with it; s of its own, and with all that it calls."""
Profile = Mapping[Function, tuple[int, int, float, float, Mapping[Function, Calls]]]
"""Calls of each function, and of these the calls by each caller."""

PACKAGE = "riseg_drake"
STEPPING, DRAWING, REST = "Drake: physics and events", "Drake: pictures and ports", "Python and imports"
_OF_DRAKE = {"AdvanceTo": STEPPING, "Initialize": STEPPING, "Eval": DRAWING, "EvalAbstract": DRAWING}
_OF_STATION = {"physics.py": STEPPING, "wrist_camera.py": DRAWING}
"""Newer versions' functions of Drake are in no profile: what they take is the own time of who calls them."""
_LEAST = 1e-9
"""s that a call takes, however short."""
_DEEPEST = 50
"""Libraries' functions that call each other before one of the package's is reached."""
DEAREST = 12
"""Functions of the second table."""


def bench_run(scenario_file: Path | None, seed: int, json_file: Path | None, console: Console) -> None:
    """Run one scene under a profiler of processor time and print what each room took of it."""
    scenario = load_scenario(scenario_file)
    _ = scenario.simulated  # says so where it is not
    require_graphics()
    profiler, start = cProfile.Profile(process_time), (perf_counter(), process_time())
    progress = Progress()
    with console.status("placing the objects") as status:
        narrator = Narrator(console, status)
        with profiler:
            wired = make_diagram(scenario, seed)
            follow = (lambda *_: narrator.follow(progress),)
            for _ in interactions(wired, StageClock(), progress, scenario.longest, follow):
                pass
    wall, processor = perf_counter() - start[0], process_time() - start[1]
    functions: Profile = pstats.Stats(profiler).stats  # type: ignore[attr-defined]
    rooms, dearest = seconds_by_room(functions), _dearest(functions)
    total, made = sum(rooms.values()), max(progress.interaction_step - 1, 0)
    console.print(_table(rooms, total, f"{made} interactions, {progress.frames} frames", "room"))
    console.print(_table(dearest, total, f"the {DEAREST} dearest functions, by their own time", "function"))
    console.print(
        f"{processor:.0f} s of processor time in {wall:.0f} s, the profiler's own among it, for "
        f"{progress.time:.0f} s of the robot's; {peak_memory_mb()} MB at most"
    )
    if json_file is not None:
        figures: dict[str, Any] = {"seed": seed, "interactions": made}
        figures |= {"frames": progress.frames, "simulated_s": progress.time, "wall_s": wall}
        figures |= {"processor_s": processor, "rooms_s": rooms, "functions_s": dearest}
        write_told(json_file, to_json({**figures, "peak_memory_mb": peak_memory_mb()}).encode())


def seconds_by_room(functions: Profile) -> dict[str, float]:
    """Own time of all functions, s, by the room that they are in, the dearest first.

    What a library takes counts for the rooms that called it, in proportion to the time it took for each.
    """
    place = {function: n for n, function in enumerate(functions)}
    room_of = [_room(function) for function in functions]
    names = sorted({room for room in room_of if room})
    own_room = np.array([[room == name for name in names] for room in room_of], float).reshape(-1, len(names))
    calls = sparse.lil_array((len(place), len(place)))
    for (function, n), room in zip(place.items(), room_of, strict=True):
        if not room:
            for caller, (*_, seconds) in functions[function][4].items():
                if caller != function:  # who calls itself does so for another
                    calls[n, place[caller]] = max(seconds, _LEAST)
    by_caller = sparse.diags_array(1 / np.maximum(calls.sum(axis=1), _LEAST)) @ calls.tocsr()
    share = own_room
    for _ in range(_DEEPEST):
        share = own_room + by_caller @ share
    own = np.array([about[2] for about in functions.values()])
    rooms = dict(zip(names, (own @ share).tolist(), strict=True))
    rest = float(own.sum() - sum(rooms.values()))  # of what nobody called
    rooms |= {REST: rest} if rest > _LEAST else {}
    return dict(sorted(rooms.items(), key=lambda item: -item[1]))


def _room(function: Function) -> str:
    """The room of the package, or the part of Drake, that a function belongs to; none for other libraries."""
    file, _, name = function
    if file == "~" and "pydrake.systems" in name:
        for method, part in _OF_DRAKE.items():
            if name.endswith(f"{method}}}") or name.endswith(f".{method}>"):
                return part
    parts = PurePath(file).parts
    if PACKAGE not in parts:
        return ""
    after = parts[len(parts) - parts[::-1].index(PACKAGE) :]
    if after[0] == "stations" and after[-1] in _OF_STATION:
        return _OF_STATION[after[-1]]
    return after[0] if len(after) > 1 else PACKAGE


def _dearest(functions: Profile) -> dict[str, float]:
    by_time = sorted(functions.items(), key=lambda item: -item[1][2])[:DEAREST]
    return {_name(function): about[2] for function, about in by_time}


def _name(function: Function) -> str:
    file, line, name = function
    if file == "~":
        return name.strip("{}<>")
    parts = PurePath(file).parts
    start = parts.index(PACKAGE) if PACKAGE in parts else -2
    return f"{'/'.join(parts[start:])}:{line} {name}"


def _table(seconds: Mapping[str, float], total: float, title: str, first: str) -> Table:
    """One row a name, with its share of a total, s."""
    table = Table(box=box.SIMPLE, title=title, title_justify="left")
    table.add_column(first, justify="left")
    table.add_column("s", justify="right")
    table.add_column("%", justify="right")
    for name, each in seconds.items():
        table.add_row(name, f"{each:.1f}", f"{100 * each / total:.0f}")
    return table
