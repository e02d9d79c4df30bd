"""Toy food and patterned animals, and the programs that draw them: outline, solid, paint, collision."""
