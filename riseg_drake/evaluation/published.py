"""The paper's own figures, to be put beside ours.

Source: Qian et al., *rt-RISeg: Real-Time Model-Free Robot Interactive Segmentation for Active
Instance-Level Object Understanding*, Table 1 (Overlap and Boundary) and the data of the figure "Correct
Segments (%)" (share of objects with Overlap F of 75 % or more). Means over 20 real scenes of 4 to 6 toys,
after 0 to 5 interactions.
"""

from typing import NamedTuple


class PublishedRow(NamedTuple):
    """One method after one interaction, in percent as printed."""

    overlap_precision: float
    overlap_recall: float
    overlap_f: float
    boundary_precision: float
    boundary_recall: float
    boundary_f: float
    found_share: float


PUBLISHED: dict[str, tuple[PublishedRow, ...]] = {
    "rt-RISeg": (
        PublishedRow(100.0, 0.0, 0.0, 100.0, 0.0, 0.0, 0.000),
        PublishedRow(89.2, 19.6, 30.5, 54.8, 12.5, 19.2, 25.185),
        PublishedRow(92.7, 34.5, 48.4, 54.2, 21.5, 30.0, 35.980),
        PublishedRow(92.9, 48.3, 60.6, 51.7, 30.0, 37.0, 52.813),
        PublishedRow(89.9, 59.9, 70.1, 57.1, 39.8, 46.3, 67.436),
        PublishedRow(85.2, 71.8, 75.4, 55.8, 49.3, 51.8, 75.100),
    ),
    "rt-RISeg + SAM": (
        PublishedRow(100.0, 0.0, 0.0, 100.0, 0.0, 0.0, 0.000),
        PublishedRow(98.4, 21.1, 32.4, 86.7, 21.3, 31.8, 23.796),
        PublishedRow(98.4, 36.5, 51.6, 80.0, 34.4, 46.8, 36.471),
        PublishedRow(98.5, 51.6, 65.2, 80.1, 49.7, 59.5, 54.896),
        PublishedRow(96.8, 61.9, 74.1, 82.6, 61.2, 69.5, 65.513),
        PublishedRow(91.4, 73.4, 79.5, 79.1, 72.4, 74.9, 76.667),
    ),
    "SAM": (
        PublishedRow(63.6, 59.0, 61.1, 35.3, 62.1, 43.7, 61.389),
        PublishedRow(62.7, 53.3, 55.2, 36.3, 54.3, 39.3, 56.019),
        PublishedRow(61.7, 55.2, 57.8, 34.9, 57.8, 41.5, 55.980),
        PublishedRow(58.6, 52.8, 55.0, 33.3, 55.3, 39.4, 50.521),
        PublishedRow(60.0, 57.5, 58.6, 31.6, 58.5, 39.9, 58.718),
        PublishedRow(57.0, 52.3, 54.1, 29.3, 53.5, 35.9, 51.833),
    ),
    "MSMFormer": (
        PublishedRow(76.9, 40.7, 45.7, 55.1, 31.7, 31.6, 32.315),
        PublishedRow(79.9, 43.5, 48.9, 56.8, 34.8, 34.4, 37.870),
        PublishedRow(80.7, 42.1, 49.6, 53.1, 33.9, 35.0, 39.608),
        PublishedRow(84.0, 44.5, 51.2, 61.7, 37.0, 38.7, 43.646),
        PublishedRow(77.9, 40.9, 48.2, 54.2, 35.3, 36.3, 36.026),
        PublishedRow(77.0, 51.0, 59.0, 47.9, 40.3, 41.5, 44.000),
    ),
}
"""By method, one row for each interaction step 0 to 5."""
