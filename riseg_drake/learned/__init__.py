"""Learned parts that the project works without: RAFT for the flow, Segment Anything for the outlines."""
