"""From where on a recording is doubted."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PlausibilityLimits:
    """What a right recording does not exceed; measured on right and wrong ones (docs/recordings.md).

    Pixels are those of an image that is `width` pixels wide at most; larger ones are made smaller first.
    """

    width: int = 320
    """Pixels; flow of so small an image is cheap, and errors that matter are seen in it."""
    scale: float = 2.4
    """Factor by which a table scene may be larger or smaller than the usual one. Three real recordings and
    eleven rendered ones lie within 1.22 of it; five times too large they are 2.5 or more."""
    still: float = 1.5
    """Pixels (median) by which a table may seem to move that stands still; good visual odometry leaves half
    a pixel, joint angles of a simulated arm a tenth."""
    still_share: float = 0.35
    """... and the share of the flow that is seen, where this is more: a rolling shutter, late stamps."""
    explained: float = 0.4
    """Share of what contradicts the images that may be left under another reading, for it to be named."""
    pairs: float = 0.34
    """Share of the pairs of frames, two at least, that must contradict: poses that stop early do so in some."""
    shift: float = 3.5
    """Pixels by which depth may lie off colour: shadows beside steps are as wide in stereo cameras."""
    shift_gain: float = 1.03
    """How much better edges must agree at another shift than where they lie. On right recordings it is 1.01 at
    most (docs/recordings.md); at 8 pixels 1.4 to 2.7, but 1.05 on a real one whose depth is of low quality."""
    shift_errors: float = 1.0
    """... and by how many of its own standard errors, as the parts of the image tell them. Drawn things, whose
    texture is as strong as their edges, reach 0.6 in small images; at 8 pixels the real recording of low
    quality has 1.2, all others at least 2.2."""
    jump: float = 0.06
    """Share of the image's width that things may move by between two frames: optical flow is worked out that
    far around them. Right recordings reach 0.04, jumps of 50 mm at half a metre 0.08."""
    filled: float = 0.5
    """Share of the image that one thing may take; the table is what the rest of it shows."""
    hollow: float = 0.5
    """Share of an image that may be without depth."""
    pause: float = 5.0
    """s between frames; stamps in other units make a hundred times more of it."""
