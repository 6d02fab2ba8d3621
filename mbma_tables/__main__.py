"""``python -m mbma_tables`` is the command line `mbma`."""

import contextlib
import os
import sys

INTERRUPTED = 130  # as shells report Ctrl-C


def main() -> None:
    """Run the command line; Ctrl-C is handled from the start, also during imports."""
    try:
        from mbma_tables.cli import main

        main(prog_name="mbma")
    except (KeyboardInterrupt, SystemExit) as end:
        if isinstance(end, SystemExit) and end.code != INTERRUPTED:
            raise
        # Python would end by the signal instead where it fell into code that `exec` ran,
        # such as a dataclass
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError):
                stream.flush()
        os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
