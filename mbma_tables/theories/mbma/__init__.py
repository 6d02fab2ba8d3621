"""The MBMA model: islands, their tables and closed forms, their sums, and the theory."""
