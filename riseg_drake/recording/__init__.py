"""Floor 1: RGB-D folders in and out, in the layout of the TUM RGB-D data sets."""
