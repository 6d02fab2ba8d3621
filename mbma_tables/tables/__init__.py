"""Surrogate tables: made, certified, written, read, looked up."""
