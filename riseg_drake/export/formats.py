"""What `--export` can be asked for."""

FORMATS = ("coco", "bop", "npz", "bundlesdf", "clouds", "poses")
