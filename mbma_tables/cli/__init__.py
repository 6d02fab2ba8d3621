"""The command line `mbma`: contact, curves and islands of a surface, as a table, JSON, CSV or a picture.

Bad input ends with one or two lines on stderr and exit code 2, before anything is written. Whatever needs
numba or scipy is imported where a command runs, so that ``--help`` answers at once.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

import click

from mbma_tables import __version__
from mbma_tables.cli import progress
from mbma_tables.cli.batch import batch_command
from mbma_tables.cli.commands import contact_command, curve_command, island_command, surfaces_command
from mbma_tables.cli.cost import cost_command
from mbma_tables.cli.export import explore_command, export_command
from mbma_tables.cli.fit import fit_command
from mbma_tables.cli.scene import plan_command, run_command
from mbma_tables.cli.sensitivity import sensitivity_command
from mbma_tables.cli.tables import tables_group
from mbma_tables.errors import MbmaError

BAD_INPUT = 2
INTERRUPTED = 130  # as shells report Ctrl-C


def _describe(fault: Exception) -> str:
    """One line for what went wrong, and for misuse of the command line a second with a hint."""
    if isinstance(fault, click.ClickException):
        line = " ".join(fault.format_message().split())
        if isinstance(fault, click.UsageError) and fault.ctx is not None:
            return f"{line}\n(see '{fault.ctx.command_path} --help')"
        return line
    if isinstance(fault, OSError) and fault.strerror is not None:
        return fault.strerror if fault.filename is None else f"{fault.filename}: {fault.strerror}"
    return " ".join(str(fault).split())


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning as one line."""
    click.echo(f"mbma: warning: {' '.join(str(message).split())}", err=True)


class Program(click.Group):
    """A group of commands whose every known fault ends in a short message."""

    def main(self, *args: Any, **extra: Any) -> Any:
        """Run, and exit with 0, with 2 for bad input, or with 130 where it was interrupted."""
        extra["standalone_mode"] = False
        warnings.showwarning = _show_warning
        try:
            with progress.shown("starting"):
                code = super().main(*args, **extra)
        except click.Abort:
            click.echo("mbma: interrupted", err=True)
            sys.exit(INTERRUPTED)
        except (click.ClickException, MbmaError, OSError) as fault:
            click.echo(f"mbma: {_describe(fault)}", err=True)
            sys.exit(BAD_INPUT)
        sys.exit(code if isinstance(code, int) else 0)


@click.group("mbma", cls=Program, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="mbma")
@click.pass_context
def main(context: click.Context) -> None:
    """Contact of rough surfaces: force, real contact area and stiffness against gap or pressure.

    A file named - is standard input or output. Bash completes options and names after
    eval "$(_MBMA_COMPLETE=bash_source mbma)"; zsh and fish likewise.

    Example: mbma curve --surface concrete --plot concrete.png
    """
    if context.invoked_subcommand is None:
        progress.echo(context.get_help())
        return
    progress.doing(context.invoked_subcommand)


for command in (
    contact_command,
    curve_command,
    batch_command,
    island_command,
    surfaces_command,
    fit_command,
    sensitivity_command,
    tables_group,
    plan_command,
    run_command,
    cost_command,
    export_command,
    explore_command,
):
    main.add_command(command)
