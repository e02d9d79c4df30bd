"""The scales of what is seen, each named once: the defaults of all thresholds that are one of them.

What is a small object, what is one motion, and how far measurements are to be believed. A threshold elsewhere
that is none of these says where it comes from.
"""

SMALLEST_OBJECT = 3.0e-4
"""m^2, as large as it appears from above: a square of 17 mm (a lying AA battery has 7e-4, a coin of a cent
2e-4). What is smaller is no object of its own. Set by hand."""
SMALLEST_SEEN = 1.0e-4
"""m^2; a third of that: what may be seen of one that is half hidden, and what is smaller is noise."""
LOWEST = 0.004
"""m; a step of height that is one, and how far above the table begins what stands on it: four standard
deviations of depth at 0.65 m."""
FLOW_NOISE = 0.2
"""Pixels; standard deviation of optical flow where there is texture, of DIS on rendered pairs."""
DEPTH_NOISE = 0.0023
"""m at 1 m; standard deviation of depth, which grows with its square: 0.08 pixels of disparity of a D415,
whose baseline is 55 mm. Where a table is seen, that of each frame is read off it."""
SAME_MOTION = 0.35
"""Pixels (root mean square); motions that predict flow within that are one: not twice `FLOW_NOISE`, so no
clustering can tell them apart. Set by hand."""
OUTLIER = 9.0
"""A squared residual in variances, three standard deviations: from there on it is no noise."""
CORRELATED_GRAY = 6.0
"""Pixels whose errors of gray are alike (pose, interpolation). Set by hand."""
CORRELATED_DEPTH = 28.0
"""Pixels whose errors of depth are alike, as matching windows overlap: 4 pi sigma^2 for noise that is
smoothed over 1.5 pixels (docs/sensing.md)."""
EXPECTED = 2.0
"""Squared residuals of a pixel's gray and depth, both, in variances of their noise, where a motion is right."""
HIDDEN = 1.0
"""Times `EXPECTED` or what is usual, by which a hidden pixel is worse than one that matches: few things go just
where nobody can see them. Set by hand."""
