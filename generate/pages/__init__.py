"""Pages of the documentation: measured, drawn, written."""
