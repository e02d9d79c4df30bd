"""The wired diagrams, and the command line `riseg`."""
