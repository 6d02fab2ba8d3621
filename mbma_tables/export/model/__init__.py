"""The model and its tables as C, and formulas of tables."""
