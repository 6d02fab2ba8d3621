"""Laws as rows of numbers, for solvers and as data."""
