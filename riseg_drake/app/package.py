"""What the installed package says of itself: its version, its extras and what these need."""

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, metadata, version

from packaging.requirements import Requirement

NAME = "riseg-drake"


def package_version() -> str:
    """The version that is installed, or "not installed" where the package only lies on Python's path."""
    return _version_of(NAME) or "not installed"


def extras() -> Mapping[str, list[str]]:
    """By extra, the requirements that are not met; an empty list: all that it needs is there.

    Extras and their needs are those of the package's metadata, so that a new one is known here by itself.
    """
    try:
        about = metadata(NAME)
    except PackageNotFoundError:
        return {}
    needs = [Requirement(line) for line in about.get_all("Requires-Dist") or []]
    return {extra: _unmet(extra, needs) for extra in sorted(about.get_all("Provides-Extra") or [])}


def _unmet(extra: str, needs: list[Requirement]) -> list[str]:
    """What an extra needs beyond the package itself and is missing, or there in another version."""
    # An extra that takes in another one of this package has that one's line to tell.
    own = [need for need in needs if need.name != NAME and _is_for(need, extra) and not _is_for(need, "")]
    return [f"{need.name}{need.specifier}" for need in own if not _is_met(need)]


def _is_for(need: Requirement, extra: str) -> bool:
    return need.marker is None or need.marker.evaluate({"extra": extra})


def _is_met(need: Requirement) -> bool:
    there = _version_of(need.name)
    return there is not None and need.specifier.contains(there, prereleases=True)


def _version_of(distribution: str) -> str | None:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return None
