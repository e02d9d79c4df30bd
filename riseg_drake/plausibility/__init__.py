"""Whether a recording can be what it says it is, asked of a few frames before any work (not in the paper)."""
