"""Scores as the field computes them, and the report made of them."""
