"""Contact with a hardness: formulas, and any theory with them."""
