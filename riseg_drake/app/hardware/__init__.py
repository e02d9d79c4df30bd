"""The real arm, and the person beside it: `riseg hardware`, `riseg hand-eye`."""
