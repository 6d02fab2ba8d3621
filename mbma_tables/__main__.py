"""``python -m mbma_tables`` is the command line `mbma`."""

import sys


def main() -> None:
    """Run it; Ctrl-C ends it from the start, its own imports included."""
    try:
        from mbma_tables.cli import main

        main(prog_name="mbma")
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
