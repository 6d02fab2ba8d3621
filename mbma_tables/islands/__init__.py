"""The island problem: variants of the paper, geometry, solution."""
