"""The command line `mbma`: results as tables, JSON, CSV or pictures.

Bad input ends with one or two lines on stderr and exit code 2, before anything is written. Modules that
need scipy are imported by the commands that use them, so that ``--help`` is fast.
"""

import functools
import re
import sys
import warnings
from collections.abc import Sequence
from typing import Any

import click

from mbma_tables import __version__
from mbma_tables.cli import commands, export, scene, tables
from mbma_tables.cli.options import format_options
from mbma_tables.common import progress
from mbma_tables.common.errors import MbmaError
from mbma_tables.core import core

BAD_INPUT = 2
INTERRUPTED = 130  # as shells report Ctrl-C


# texts for Python, in a shell
SAID = {
    "surface.fit()": "--model self-affine",
    "outside='exact'": "--island-model exact",
    "ask method='full', or ": "give ",
    "give the surface its unit": "give --length-unit",
    "force must be": "--pressure must be",
    "k1 must be": "--conductivity must be",
    "k2 must be": "--conductivity must be",
}


def _in_options(text: str, command: click.Command, words: list[str]) -> str:
    """A message of the library with its argument names, and English words at its begin, as options of a command."""
    # messages on a file keep the file's own names
    if "--" in text or text.startswith(tuple(word + end for word in words for end in ":,")):
        return text
    for python, shell in SAID.items():
        text = text.replace(python, shell)
    options = {o.name: max(o.opts, key=len) for o in command.params if isinstance(o, click.Option) and o.name}
    names = "|".join(options) or "^$"
    signs = "|".join(name for name in options if re.search(r"[A-Z_\d]|^d[xy]$|^rtol$", name)) or "^$"
    text = re.sub(rf"\b({names})=(['\w.-]+)", lambda m: f"{options[m[1]]} {m[2].strip(chr(39))}", text)
    # not in formulas, nor where a number was found
    outside = rf"(?<![\w/.*^'-])(?<![<>=] )({signs})(?![\w/(^*'.])(?! ?[<>]| ?=(?! '))"
    for place in (outside, rf"^({names})(?= (?:must|has|is)\b|: )"):
        text = re.sub(place, lambda m: options[m[1]], text)
    # in lists with an option
    for _ in options:
        text = re.sub(rf"(--[\w-]+(?:,|,? and|,? or) )({names})\b", lambda m: m[1] + options[m[2]], text)
        text = re.sub(rf"(?<![\w-])({names})(?=,? (?:and |or )?--)", lambda m: options[m[1]], text)
    return text


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning as one line."""
    click.echo(f"mbma: warning: {' '.join(str(message).split())}", err=True)


class Program(click.Group):
    """A group of commands whose expected errors end in a short message."""

    def main(self, args: Sequence[str] | None = None, *more: Any, **extra: Any) -> Any:
        """Run, and exit with 0, with 2 for bad input, or with 130 where it was interrupted."""
        words = list(sys.argv[1:] if args is None else args)
        extra["standalone_mode"] = False
        warnings.showwarning = _show_warning
        try:
            with progress.shown("starting"):
                code = super().main(words, *more, **extra)
        except click.Abort:
            click.echo("mbma: interrupted", err=True)
            sys.exit(INTERRUPTED)
        except (click.ClickException, MbmaError, OSError) as fault:
            text = fault.format_message() if isinstance(fault, click.ClickException) else str(fault)
            said = " ".join(text.split())
            if isinstance(fault, click.UsageError) and fault.ctx is not None:
                said += f"\n(see '{fault.ctx.command_path} --help')"
            if isinstance(fault, MbmaError):
                said = _in_options(said, next((self.commands[w] for w in words if w in self.commands), self), words)
            click.echo(f"mbma: {said}", err=True)
            sys.exit(BAD_INPUT)
        sys.exit(code if isinstance(code, int) else 0)


@click.group("mbma", cls=Program, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(
    __version__, prog_name="mbma", message=f"%(prog)s %(version)s, core {core.__name__.rpartition('.')[2].lstrip('_')}"
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
    *(commands.contact_command, commands.curve_command, commands.sensitivity_command, commands.island_command),
    *(commands.fit_command, tables.tables_group),
    *(tables.cache_command, scene.joint_command, scene.plan_command, scene.run_command, commands.cost_command),
    *(export.export_command, export.explore_command),
):
    command.format_options = functools.partial(format_options, command)  # type: ignore[method-assign]
    main.add_command(command)
