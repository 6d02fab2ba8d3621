"""`contact` and what it returns: units, shapes and checks enter and leave here."""
