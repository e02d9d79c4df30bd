"""Household things, and the program that makes them."""
