"""Stamps, and folders of masks beside the images: whether they are what they are taken for."""

from collections.abc import Mapping

from riseg_drake.plausibility.limits import PlausibilityLimits

_UNITS = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
_USUAL = 1 / 15
"""s between frames, about."""


def doubts_about_rate(rate: float, count: int, limits: PlausibilityLimits) -> list[str]:
    """Whether stamps are seconds, given the frames a second (median) and how many there are."""
    if count < 2 or rate * limits.pause >= 1:
        return []
    apart = 1 / rate
    unit = min(_UNITS, key=lambda name: max(apart / _UNITS[name] / _USUAL, _USUAL * _UNITS[name] / apart))
    meant = f"they look like {unit}" if apart > _USUAL * 100 else "flow cannot follow that"
    return [f"stamps are {apart:.4g} s apart (median); {meant}; stamps are seconds"]


def doubts_about_names(
    count: int, beside: Mapping[str, int], unused: Mapping[str, str], example: str
) -> list[str]:
    """Whether masks are named as the images they belong to.

    Args:
        count: how many frames there are.
        beside: of each folder that holds images, how many frames have one of their name in it.
        unused: of each folder that nobody asks for, the name of one of its files.
        example: the name of a colour image.
    """
    doubts = [
        f"{folder}/ is not used: no file in it is named as a colour image, as {example} is"
        for folder, number in beside.items()
        if number == 0
    ]
    doubts += [
        f"{folder}/ (with {file}) is not used; robot/ holds the robot's own pixels, label/ true object ids"
        for folder, file in unused.items()
    ]
    return doubts
