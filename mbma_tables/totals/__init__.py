"""Totals over islands."""
