"""The command line `mbma`: results as tables, JSON, CSV or pictures.

Bad input ends with one or two lines on stderr and exit code 2, before anything is written.
Modules that need scipy are imported by the commands that use them, so that ``--help`` is
fast.
"""

import functools
import sys
import warnings
from collections.abc import Sequence
from typing import Any

import click

from mbma_tables import __version__
from mbma_tables.cli import commands, contents, export, formula, scene, tables
from mbma_tables.cli.options import format_options
from mbma_tables.common import progress
from mbma_tables.common.errors import MbmaError
from mbma_tables.common.plain_text import visible
from mbma_tables.core import core

BAD_INPUT = 2
INTERRUPTED = 130  # as shells report Ctrl-C


# remedies for Python, in a shell
REMEDIES = {
    "surface.fit()": "--model self-affine",
    "Joint and uncertainty take": "mbma contact, joint and batch take",
    "outside='exact'": "--island-model exact",
    "outside='nan'": "--outside nan",
    "give the surface its unit": "give --length-unit",
}


# the same for commands that read the options of a theory from a file
ENTRIES = {
    "outside='exact'": "--set island_model=exact",
    "outside='nan'": "--set outside=nan",
}


def _for_a_shell(text: str, command: click.Command | None) -> str:
    """`text` with its remedies as options of `command`, or as entries of the file that it reads."""
    options = {
        name for given in (command.params if command else ()) for name in given.opts
    }
    for python, shell in (ENTRIES if "--set" in options else REMEDIES).items():
        text = text.replace(python, shell)
    return text


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning as one line."""
    click.echo(f"mbma: warning: {visible(' '.join(str(message).split()))}", err=True)


class CommandGroup(click.Group):
    """A group of commands whose expected errors end in a short message."""

    def main(self, args: Sequence[str] | None = None, *more: Any, **extra: Any) -> Any:
        """Run, and exit with 0, with 2 for bad input, or with 130 where it was interrupted."""
        words = list(sys.argv[1:] if args is None else args)
        extra |= {"standalone_mode": False, "obj": words}
        warnings.showwarning = _show_warning
        try:
            with progress.shown("starting"):
                code = super().main(words, *more, **extra)
        except click.Abort:
            click.echo("mbma: interrupted", err=True)
            sys.exit(INTERRUPTED)
        except (click.ClickException, MbmaError, OSError) as fault:
            text = (
                fault.format_message()
                if isinstance(fault, click.ClickException)
                else str(fault)
            )
            said = visible(" ".join(text.split()))
            if isinstance(fault, click.UsageError) and fault.ctx is not None:
                said += f"\n(see '{fault.ctx.command_path} --help')"
            command = self.commands.get(words[0]) if words else None
            click.echo(f"mbma: {_for_a_shell(said, command)}", err=True)
            sys.exit(BAD_INPUT)
        sys.exit(code if isinstance(code, int) else 0)


@click.group(
    "mbma",
    cls=CommandGroup,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(
    __version__,
    prog_name="mbma",
    message=f"%(prog)s %(version)s, core {core.__name__.rpartition('.')[2].lstrip('_')}",
)
@click.pass_context
def main(context: click.Context) -> None:
    """Contact of rough surfaces: pressure, real contact area and stiffness against gap or pressure.

    A file named - is standard input or output. Bash completes options and names after
    eval "$(_MBMA_COMPLETE=bash_source mbma)"; zsh and fish likewise.

    Example: mbma curve --surface concrete --plot concrete.png
    """
    if context.invoked_subcommand is None:
        progress.echo(context.get_help())
        return
    progress.doing(context.invoked_subcommand)


for command in (
    *(contents.show_command, contents.sample_command, contents.plot_command),
    formula.formula_command,
):
    tables.tables_group.add_command(command)

for command in (
    *(
        commands.contact_command,
        commands.curve_command,
        commands.sensitivity_command,
        commands.island_command,
    ),
    *(commands.fit_command, tables.tables_group),
    *(
        tables.cache_command,
        scene.joint_command,
        scene.batch_command,
        scene.plan_command,
        scene.run_command,
        commands.cost_command,
    ),
    *(export.export_command, export.explore_command),
):
    command.format_options = functools.partial(format_options, command)  # type: ignore[method-assign]
    main.add_command(command)
