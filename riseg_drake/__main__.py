"""`python -m riseg_drake` is `riseg`."""

try:
    from riseg_drake.app.cli import main
    from riseg_drake.host.processes import heed_no_more
except KeyboardInterrupt:  # so early that nobody else can hear it
    raise SystemExit(130) from None


def program() -> int:
    """Run a command as a process of its own; returns its exit code."""
    code = main()
    heed_no_more()
    return code


if __name__ == "__main__":
    raise SystemExit(program())
