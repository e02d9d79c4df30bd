"""Scenarios (YAML) that say which station, which stages and which parameters to wire."""
