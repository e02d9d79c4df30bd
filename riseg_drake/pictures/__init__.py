"""Floor 1: what the algorithm sees and decides, made visible. Functions from arrays to images and axes."""
