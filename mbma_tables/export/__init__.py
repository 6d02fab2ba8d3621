"""The model, its tables and its laws written for other programs: one module a target."""
