"""Contacts: the questions that surfaces, bodies and theories answer, and their results."""
