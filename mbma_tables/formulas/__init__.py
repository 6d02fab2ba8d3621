"""Closed forms of the model: a small expression language, the file that holds the forms, printers, closed totals."""
