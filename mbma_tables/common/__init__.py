"""Checks of arguments, units, errors, files, text and HTML, figures."""
