"""Surfaces by numbers, spectrum, profile or map; the paper's variants."""
