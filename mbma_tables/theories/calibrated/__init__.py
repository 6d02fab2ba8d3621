"""The law calibrated on boundary-element simulations: formulas, table, curves of maps, and the theory."""
