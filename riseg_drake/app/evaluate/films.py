"""`riseg evaluate --suite films`: what of a film is taken for an object, where nothing or little moves.

Ten films of still scenes by the simulated camera with all its errors, and recordings of one's own, begun with
each of their first frames in turn: which frame is the first must not matter. Each leaves its masks in a folder
of its own with a `film.json`; what is finished is not done again.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from time import process_time
from typing import Any

from rich.console import Console
from rich.progress import track

from riseg_drake.app.evaluate.depth_figures import DEPTH_PICTURE, depth_figures, depth_table, draw_depth
from riseg_drake.app.evaluate.scene_work import limited_threads
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output import RECORDING
from riseg_drake.app.output_folder import OutputFolder, read_json, to_json
from riseg_drake.app.scenario import load_scenario
from riseg_drake.app.segment.recorded_view import recorded_view
from riseg_drake.app.segment.replay import Replay
from riseg_drake.evaluation.film_scores import FilmScores, film_table
from riseg_drake.evaluation.true_things import true_things
from riseg_drake.pictures.masks import draw_masks
from riseg_drake.recording.layout import CAMERA_FILE, RecordingError
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.recording.whole_file import write_png, write_text
from riseg_drake.recording.writer import RecordingWriter
from riseg_drake.segmentation.table_plane import NoPlaneError
from riseg_drake.stations.still_film import StillFilmParameters, still_film

FILMS = 10
STARTS = 5
"""So many times is a recording segmented, begun with frame 0, 1, ..."""
FILM_FILE = "film.json"
REPORT = "films.md"
SUITE = "films"


def films_command(
    seed: int,
    recordings: Path | None,
    output: Path | None,
    scenario: Path | None,
    overwrite: bool,
    console: Console,
) -> None:
    """Make the films that are missing, segment what is not segmented, and write the tables.

    Args:
        seed: of the first film; the others follow.
        recordings: a folder of recordings, or None.
        output: folder (out/films_seed_S).
        scenario: parameters of the segmentation, or None for the built-in ones.
        overwrite: whether earlier films in that folder are removed first.
        console: where to tell of it.

    Raises RecordingError, ThingsError or OutputError.
    """
    require_graphics()
    real = _recordings(recordings)
    path = output or Path("out") / f"films_seed_{seed}"
    own = [path / f"film_{film:03d}" for film in range(seed, seed + FILMS)]
    theirs = [path / recording.resolve().name for recording in real]
    if clash := sorted(folder.name for folder in {*own} & {*theirs}):
        raise RecordingError(f"a recording is named {clash[0]}, as a film that is made here; rename it")
    settings = {"suite": SUITE, "seed": seed, "scenario": str(scenario or "")}
    with _claimed(path, settings, [*own, *theirs], overwrite) as folder:
        rows: list[tuple[str, dict[str, Any]]] = []
        with limited_threads(1):
            for film, work in enumerate(own, seed):
                result = _finished(work)
                if not result:
                    _shoot(work / RECORDING, film, console)
                    result = segment_film(work / RECORDING, work, scenario, film, console)
                rows.append((f"still scene, seed {film}", result))
            for recording, work in zip(real, theirs, strict=True):
                rows += _begun_with_each(recording, work, scenario, console)
            shown = {"simulated": own[0] / RECORDING, **dict(zip([w.name for w in theirs], real, strict=True))}
            figures = {name: depth_figures(recording) for name, recording in shown.items()}
        all_films = _together([row for _, row in rows[:FILMS]])
        tables = film_table([("ten still scenes", all_films), *rows[FILMS:], *rows[:FILMS]])
        report = "\n".join(["# Films", "", *tables, "", "# Depth", "", *depth_table(figures), ""])
        with folder.writing():
            draw_depth(list(shown.values()), path / DEPTH_PICTURE)
            write_text(path / REPORT, report)
        folder.note(state="done", films=dict(rows), depth=figures)
    console.print(report, markup=False, highlight=False, soft_wrap=True)
    console.print(f"report in {path / REPORT}", highlight=False)


def segment_film(
    recording: Path, work: Path, scenario: Path | None, seed: int, console: Console, start: int = 0
) -> dict[str, Any]:
    """Segment one film into a folder: masks, the worst frame's picture, and the scores, which are returned.

    The frames before number `start` are left out.
    """
    reader = RecordingReader(recording)
    parameters = load_scenario(scenario)
    replay = Replay(parameters, recorded_view(reader, parameters, None, "camera").view, seed)
    scores = FilmScores(true_things(recording))
    (work / "mask").mkdir(parents=True, exist_ok=True)
    most, worst = -1, None
    frames = islice(_told(reader, len(reader), f"segment {work.name}", console), start, None)
    for number, frame in enumerate(frames, start):
        began = process_time()
        try:
            mask = replay.mask_after(frame)
        except NoPlaneError as error:
            reader.leave_out(frame, str(error))
            scores.without_table += 1
            continue
        before = scores.false_pixels
        scores.add(number, mask, frame.robot, process_time() - began)
        write_png(work / "mask" / f"{number:06d}.png", mask)
        if scores.false_pixels - before > most:
            most, worst = scores.false_pixels - before, draw_masks(frame.color, mask)
    if worst is not None:
        write_png(work / "worst.png", worst)
    result = scores.as_dict()
    write_text(work / FILM_FILE, to_json(result))
    return result


def _begun_with_each(
    recording: Path, work: Path, scenario: Path | None, console: Console
) -> list[tuple[str, dict[str, Any]]]:
    """Rows of a recording, begun with each of its first frames."""
    rows = []
    for start in range(min(STARTS, len(RecordingReader(recording)))):
        folder = work / f"from_{start}" if start else work
        row = _finished(folder) or segment_film(recording, folder, scenario, 0, console, start)
        rows.append((f"{work.name}, from frame {start}" if start else work.name, row))
    return rows


def _recordings(folder: Path | None) -> list[Path]:
    """The recordings in a folder, by name; or the folder itself, if it is one."""
    if folder is None:
        return []
    if (folder / CAMERA_FILE).is_file():
        return [folder]
    found = sorted(path.parent for path in folder.glob(f"*/{CAMERA_FILE}"))
    if not found:
        raise RecordingError(f"{folder} holds no recording; expected folders with a {CAMERA_FILE}")
    return found


def _claimed(path: Path, settings: Mapping[str, Any], films: Iterable[Path], overwrite: bool) -> OutputFolder:
    """The films' folder, new or to be gone on with; `films` are the folders in it. Raises OutputError."""
    about = {**settings, "riseg_drake": version("riseg-drake"), "state": "running"}
    parts = "|".join([re.escape(REPORT), re.escape(DEPTH_PICTURE), *(re.escape(film.name) for film in films)])

    def goes_on(earlier: Mapping[str, Any]) -> str:
        same = all(earlier.get(key) == value for key, value in settings.items())
        return "" if same else "which holds something else than these films"

    return OutputFolder(path, "evaluate", parts, about, overwrite=overwrite, goes_on=goes_on)


def _shoot(recording: Path, seed: int, console: Console) -> None:
    """Write a film of a still scene, from the start."""
    parameters = StillFilmParameters()
    for leftover in recording.glob("*.txt"):
        leftover.unlink()  # of a film that was cut off
    with RecordingWriter(recording, parameters.camera.intrinsics) as writer:
        for frame in _told(still_film(parameters, seed), parameters.frames, f"film {seed}", console):
            writer.append(frame)


def _told(items: Iterable[Any], total: int, what: str, console: Console) -> Iterable[Any]:
    return track(items, what, total=total, console=console, transient=True)


def _finished(work: Path) -> dict[str, Any]:
    """The scores of a film that was segmented before; empty where it was not, and where one is missing."""
    known = read_json(work / FILM_FILE)
    return known if set(FilmScores().as_dict()) <= set(known) else {}


def _together(films: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The figures of several films without things, as if they were one."""

    def total(key: str) -> int:
        return sum(film[key] for film in films)

    frames = max(total("frames"), 1)
    mean: Callable[[str], float] = lambda key: sum(film[key] * film["frames"] for film in films) / frames  # noqa: E731
    return {
        "frames": total("frames"),
        "without_table": total("without_table"),
        "frames_with_a_false_object": total("frames_with_a_false_object"),
        "false_pixels_a_frame": mean("false_pixels_a_frame"),
        "ms_a_frame": mean("ms_a_frame"),
        "things": {},
    }
