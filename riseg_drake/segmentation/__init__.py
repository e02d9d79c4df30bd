"""Alg. 2 of the paper, SegmentObjs, one file a line of the algorithm, on plain arrays."""
