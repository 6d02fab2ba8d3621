"""Quantities of a contact."""
