"""``python -m mbma_tables`` is the command line `mbma`."""

from mbma_tables.cli import main

main(prog_name="mbma")
