"""Table files: what stands in one, how it is written, opened and checked, and how it is interpolated."""
