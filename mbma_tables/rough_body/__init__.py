"""Rough spheres and cylinders on a flat."""
