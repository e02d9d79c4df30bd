"""The machine and what is installed, looked over: `riseg doctor`."""
