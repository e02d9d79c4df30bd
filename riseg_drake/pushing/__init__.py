"""Alg. 3 of the paper, FindAction, and the path of a push, on plain arrays."""
