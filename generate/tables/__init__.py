"""Tables: built on workers, certified, written."""
