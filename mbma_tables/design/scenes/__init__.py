"""Scenes: simulation of the requested effects only, planned by cost."""
