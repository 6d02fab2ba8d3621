"""The offline generator: everything that the library ships and that a command made."""
