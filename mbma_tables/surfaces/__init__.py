"""Rough surfaces: spectra, surfaces, readings, measured maps, the paper's cases."""
