"""Floor 3: what a segmentation saw and found, on one time line, for the Rerun viewer (not in the paper)."""
