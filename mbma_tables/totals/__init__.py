"""Pressure and area of a surface as sums over its islands."""
