"""`riseg evaluate --suite films`: what of a film is taken for an object, where nothing or little moves.

Ten films of still scenes by the simulated camera with all its errors, and recordings of one's own. Each leaves
its masks in a folder of its own with a `film.json`; what is finished is not done again.
"""

import json
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import version
from pathlib import Path
from time import process_time
from typing import Any

from rich.console import Console
from rich.progress import track

from riseg_drake.app.depth_figures import DEPTH_PICTURE, depth_figures, depth_table, draw_depth
from riseg_drake.app.graphics import require_graphics
from riseg_drake.app.output import RECORDING
from riseg_drake.app.output_folder import SUMMARY, OutputError, to_json
from riseg_drake.app.recorded_view import recorded_view
from riseg_drake.app.replay import Replay
from riseg_drake.app.scenario import load_scenario
from riseg_drake.app.scene_work import limited_threads
from riseg_drake.evaluation.film_scores import FilmScores, film_table
from riseg_drake.evaluation.true_things import true_things
from riseg_drake.geometry.plane import NoPlaneError
from riseg_drake.pictures.masks import draw_masks
from riseg_drake.recording.layout import CAMERA_FILE, RecordingError
from riseg_drake.recording.reader import RecordingReader
from riseg_drake.recording.whole_file import write_png, write_text
from riseg_drake.recording.writer import RecordingWriter
from riseg_drake.stations.still_film import StillFilmParameters, still_film

FILMS = 10
FILM_FILE = "film.json"
REPORT = "films.md"
SUITE = "films"


def films_command(
    seed: int, recordings: Path | None, output: Path | None, scenario: Path | None, console: Console
) -> None:
    """Make the films that are missing, segment what is not segmented, and write the tables.

    Args:
        seed: of the first film; the others follow.
        recordings: a folder of recordings, or None.
        output: folder (out/films_seed_S).
        scenario: parameters of the segmentation, or None for the built-in ones.
        console: where to tell of it.

    Raises RecordingError, ThingsError or OutputError.
    """
    require_graphics()
    real = _recordings(recordings)
    folder = output or Path("out") / f"films_seed_{seed}"
    _claim(folder, {"suite": SUITE, "seed": seed, "scenario": str(scenario or "")})
    rows: list[tuple[str, dict[str, Any]]] = []
    with limited_threads(1):
        for film in range(seed, seed + FILMS):
            work = folder / f"film_{film:03d}"
            recording = work / RECORDING
            result = _finished(work)
            if result is None:
                _shoot(recording, film, console)
                result = segment_film(recording, work, scenario, film, console)
            rows.append((f"still scene, seed {film}", result))
        for path in real:
            work = folder / path.resolve().name
            rows.append(
                (path.resolve().name, _finished(work) or segment_film(path, work, scenario, 0, console))
            )
        shown = [folder / f"film_{seed:03d}" / RECORDING, *real]
        figures = {path.resolve().name if path in real else "simulated": depth_figures(path) for path in shown}
    draw_depth(shown, folder / DEPTH_PICTURE)
    all_films = _together([row for _, row in rows[:FILMS]])
    tables = film_table([("ten still scenes", all_films), *rows[FILMS:], *rows[:FILMS]])
    report = "\n".join(["# Films", "", *tables, "", "# Depth", "", *depth_table(figures), ""])
    write_text(folder / REPORT, report)
    about = {
        "suite": SUITE,
        "seed": seed,
        "scenario": str(scenario or ""),
        "riseg_drake": version("riseg-drake"),
    }
    write_text(folder / SUMMARY, to_json({**about, "state": "done", "films": dict(rows), "depth": figures}))
    console.print(report, markup=False, highlight=False, soft_wrap=True)
    console.print(f"report in {folder / REPORT}", highlight=False)


def segment_film(
    recording: Path, work: Path, scenario: Path | None, seed: int, console: Console
) -> dict[str, Any]:
    """Segment one film into a folder: masks, the worst frame's picture, and the scores, which are returned."""
    reader = RecordingReader(recording)
    parameters = load_scenario(scenario)
    replay = Replay(parameters, recorded_view(reader, parameters, None, "camera").view, seed)
    scores = FilmScores(true_things(recording))
    (work / "mask").mkdir(parents=True, exist_ok=True)
    most, worst = -1, None
    for number, frame in enumerate(_told(reader, len(reader), f"segment {work.name}", console)):
        start = process_time()
        try:
            mask = replay.mask_after(frame)
        except NoPlaneError as error:
            reader.leave_out(frame, str(error))
            scores.without_table += 1
            continue
        before = scores.false_pixels
        scores.add(number, mask, frame.robot, process_time() - start)
        write_png(work / "mask" / f"{number:06d}.png", mask)
        if scores.false_pixels - before > most:
            most, worst = scores.false_pixels - before, draw_masks(frame.color, mask)
    if worst is not None:
        write_png(work / "worst.png", worst)
    result = scores.as_dict()
    write_text(work / FILM_FILE, to_json(result))
    return result


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


def _claim(folder: Path, about: dict[str, Any]) -> None:
    """Make the folder, or make sure that what it holds is this suite's."""
    try:
        if folder.is_dir() and any(folder.iterdir()) and not _is_the_same(folder, about):
            raise OutputError(
                f"{folder} holds something else than these films; give a new folder with --output"
            )
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / SUMMARY, to_json({**about, "state": "running"}))
    except OSError as error:
        raise OutputError(f"cannot write to {folder}: {error.strerror}") from None


def _is_the_same(folder: Path, about: dict[str, Any]) -> bool:
    try:
        earlier = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(earlier, dict) and {key: earlier.get(key) for key in about} == about


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


def _finished(work: Path) -> dict[str, Any] | None:
    try:
        result: dict[str, Any] = json.loads((work / FILM_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return result


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
