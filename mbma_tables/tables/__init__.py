"""Surrogate tables of contact islands: made, certified, written, read and looked up."""
