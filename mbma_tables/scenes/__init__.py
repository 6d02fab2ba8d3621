"""Scenes: only the effects that are called for, planned by cost."""
