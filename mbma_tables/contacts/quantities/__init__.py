"""Quantities of a contact: each is declared once, in a file of this folder; `registry` lists them."""
