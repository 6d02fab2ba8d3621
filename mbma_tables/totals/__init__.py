"""Totals over islands, and the other theories of the paper."""
