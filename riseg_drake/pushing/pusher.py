"""The end effector as a push needs to know it: a vertical bar with a rectangular cross section."""

from dataclasses import dataclass


@dataclass
class Pusher:
    """The bar on the flange, and where its lower end goes. E is the centre of its end face."""

    thickness: float = 0.020
    """Extent along E's x, the push direction, m."""
    width: float = 0.030
    """Extent along E's y, m."""
    length: float = 0.30
    """From the flange to the end face, m."""
    margin: float = 0.005
    """Room that must be left around the bar, m."""
    tip_height: float = 0.008
    """Height of the end face above the table during a push, m, unless the object is too low for it."""
    lowest_tip_height: float = 0.002
    """The end face never goes below this height, m: plane fit, arm and table have their errors. Nothing lower
    than this over `height_share` is pushed (4.4 mm)."""
    height_share: float = 0.45
    """The end face is at most at this share of the object's height where it is touched, so that even
    something round is met at or below its widest level."""
