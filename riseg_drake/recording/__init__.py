"""RGB-D recordings in the TUM layout, in and out, one frame at a time."""
