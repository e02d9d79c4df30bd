"""Floor 3: what a segmentation leaves in the formats of the tools that come after it."""
