"""One scene, pushed until nothing is in doubt: `riseg run`."""
