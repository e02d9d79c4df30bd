"""How fast it is: `riseg bench` and its like."""
