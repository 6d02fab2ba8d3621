"""Table files: schema, reading, checking."""
