"""Many scenes, many films, scores: `riseg evaluate`, `riseg score`."""
