"""Which images of a folder are its frames, and when they were taken: by lists, or by names."""

import re
from dataclasses import dataclass, field
from pathlib import Path

from riseg_drake.recording import layout
from riseg_drake.recording.layout import LeftOut, RecordingError
from riseg_drake.recording.source import SourceOptions
from riseg_drake.recording.stamped_lists import ListedFile, read_file_list

COLOR_FOLDERS = ("rgb", "color", "colour", "image", "images")
DEPTH_FOLDERS = ("depth", "depths", "depth_aligned")
COLOR_SUFFIXES = (".png", ".jpg", ".jpeg")
DEPTH_SUFFIXES = (".png", ".npy", ".tif", ".tiff")
_SECONDS = re.compile(r"\d+\.\d+")
_NANOSECONDS = re.compile(r"\d{19}")
_NUMBER = re.compile(r"(\d+)\D*$")


@dataclass(frozen=True)
class ImageLists:
    """Colour and depth images in rising time."""

    color: list[ListedFile]
    depth: list[ListedFile]
    color_file: Path
    """What errors call the list of colour images: a list, or a folder."""
    depth_file: Path
    unit: str = "line"
    """What is counted in it."""
    left_out: list[LeftOut] = field(default_factory=list)


def image_lists(folder: Path, options: SourceOptions, inside: Path | None) -> ImageLists:
    """The images that rgb.txt and depth.txt name, or where these are missing, those that the folders hold.

    Raises RecordingError where there are none, or where it is not clear which, or when they were taken.
    """
    color_file, depth_file = folder / layout.COLOR_LIST, folder / layout.DEPTH_LIST
    if unknown := sorted(set(options.topics) - {"color", "depth"}):
        raise RecordingError(
            f"--topics: {unknown[0]!r} is not color or depth, and a folder has no other images"
        )
    if options.world_frame is not None:
        raise RecordingError(f"--world-frame is for the transforms of a bag, and {folder} is a folder")
    if options.rate is not None and not options.topics and color_file.exists():
        raise RecordingError(f"--rate is for images without a list, and {color_file} has a stamp for each")
    if not options.topics and (color_file.exists() or depth_file.exists() or not _is_numbered(folder)):
        color, repeated = read_file_list(color_file, inside)
        depth, unordered = read_file_list(depth_file, inside)
        return ImageLists(color, depth, color_file, depth_file, left_out=repeated + unordered)
    color_folder = _folder(folder, "color", COLOR_FOLDERS, options)
    depth_folder = _folder(folder, "depth", DEPTH_FOLDERS, options)
    return ImageLists(
        _numbered(color_folder, COLOR_SUFFIXES, options.rate),
        _numbered(depth_folder, DEPTH_SUFFIXES, options.rate),
        color_folder,
        depth_folder,
        "image",
    )


def _is_numbered(folder: Path) -> bool:
    return any((folder / name).is_dir() for name in COLOR_FOLDERS)


def _folder(folder: Path, role: str, names: tuple[str, ...], options: SourceOptions) -> Path:
    """The folder with images of colour or depth: the one that is asked for, or the only one there is."""
    asked = options.topics.get(role)
    found = [folder / asked] if asked else [folder / name for name in names if (folder / name).is_dir()]
    if len(found) > 1:
        there = ", ".join(path.name for path in found)
        raise RecordingError(f"{folder} holds {there}; choose by --topics {role}=FOLDER")
    if not found or not found[0].is_dir():
        raise RecordingError(
            f"{folder} holds no {layout.COLOR_LIST}, and no folder {asked or ' or '.join(names)} with images; "
            f"name one by --topics {role}=FOLDER"
        )
    return found[0]


def _numbered(folder: Path, suffixes: tuple[str, ...], rate: float | None) -> list[ListedFile]:
    """The images of a folder by their names: stamps in seconds or in ns, or numbers at a rate, Hz."""
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in suffixes)
    if not paths:
        raise RecordingError(f"{folder} holds no {' or '.join(suffixes)}")
    times: dict[float, Path] = {}
    for path in paths:
        time = _time(path, rate)
        if time in times:
            raise RecordingError(f"{times[time]} and {path.name} have the same number; take one of them away")
        times[time] = path
    return [
        ListedFile(line, time, f"{folder.name}/{times[time].name}")
        for line, time in enumerate(sorted(times), start=1)
    ]


def _time(path: Path, rate: float | None) -> float:
    """When an image was taken, s, by its name."""
    if rate is None and _SECONDS.fullmatch(path.stem):
        return float(path.stem)
    if rate is None and _NANOSECONDS.fullmatch(path.stem):
        return int(path.stem) / 10**9
    number = _NUMBER.search(path.stem)
    if number is None:
        raise RecordingError(f"{path} has no number in its name; list the images in {layout.COLOR_LIST}")
    if rate is None:
        raise RecordingError(
            f"{path.parent} holds images without a {layout.COLOR_LIST}; --rate HZ says how many a second"
        )
    return int(number[1]) / rate
