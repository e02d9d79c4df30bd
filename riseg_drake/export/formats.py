"""What `--export` can be asked for."""

FORMATS = ("coco", "bop", "contact_graspnet", "bundlesdf", "clouds", "motions")
