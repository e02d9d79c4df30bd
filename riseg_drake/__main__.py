"""`python -m riseg_drake` is `riseg`."""

try:
    from riseg_drake.app.cli import main
except KeyboardInterrupt:  # so early that nobody else can hear it
    raise SystemExit(130) from None

if __name__ == "__main__":
    raise SystemExit(main())
