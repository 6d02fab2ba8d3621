"""Formulas: calibrated laws, hardness, leakage, gas, bearing curves; BEM."""
