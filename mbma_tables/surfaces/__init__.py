"""Rough surfaces: spectra, surfaces, variants, measured maps, the paper's cases."""
