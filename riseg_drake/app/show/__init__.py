"""What it looks like: drawings of diagrams, films, `riseg pictures`."""
