"""The island problem: variants of the paper, an island's geometry, its exact solution, and what an island model is."""
