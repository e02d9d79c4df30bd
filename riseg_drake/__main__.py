"""`python -m riseg_drake` is `riseg`."""

from riseg_drake.app.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
