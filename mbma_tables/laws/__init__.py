"""Formulas without a surface: the calibrated laws, hardness, the effective medium of leakage, bearing curves."""
