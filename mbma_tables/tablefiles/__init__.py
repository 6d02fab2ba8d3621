"""Table files: what one holds, how it is written, opened, checked and interpolated."""
