"""What every room uses: arguments, units, errors, files, display, plots."""
