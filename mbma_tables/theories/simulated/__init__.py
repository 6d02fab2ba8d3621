"""Boundary-element simulation of a map: the solver, its loads, the flow through gaps, and the theory."""
