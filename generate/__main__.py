"""``python -m generate``: remake what the library ships, and the pages of its documentation."""

import importlib
import pathlib
import sys
from typing import Any

import click

from generate.files import ROOT
from generate.page import Measured, write
from mbma_tables.common.errors import MbmaError

# imported when asked for: each needs packages of the extra "generate"
COMMANDS = {
    **{
        name: f"generate.{name}"
        for name in ("audit", "calibrated", "cost", "explorer", "leakage_law", "wheels")
    },
    **dict.fromkeys(
        ("boundary_elements", "gas", "grids", "light", "measured_maps"),
        "generate.boundary_elements.run",
    ),
    **dict.fromkeys(("film", "tangential"), "generate.machined.studies"),
    "adhesion": "generate.adhesion",
    "archive": "generate.archive",
    "artefacts": "generate.machined.artefacts",
    "drawing": "generate.drawing",
    "edges": "generate.machined.edges",
    "formulas": "generate.formulas",
    "gaps": "generate.gaps",
    "gas_flow": "generate.gas_flow",
    "machined": "generate.machined.campaign",
    "profiles": "generate.machined.profiles",
    "last_octave": "generate.machined.last_octave",
    "quantities": "generate.quantities",
    "raw_maps": "generate.machined.raw_maps",
    "rough_spheres": "generate.rough_spheres",
    "score": "generate.distances",
    "tables": "generate.tables",
    "unloaded_flow": "generate.unloaded_flow",
    "unloading": "generate.unloading",
}

# parts of the documentation, by the page that each fills and the function that measures it
PARTS = {
    "architecture": ("docs/architecture.md", "pages.library:architecture"),
    "formula": ("docs/model.md", "pages.library:formula"),
    "readme": ("README.md", "pages.library:readme"),
    "theories": ("docs/theories.md", "pages.library:theories"),
    "surfaces": ("docs/surfaces.md", "pages.surfaces:sensitivities"),
    "howto/cutoff": ("docs/howto/cutoff.md", "pages.surfaces:cutoff"),
    "howto/trust": ("docs/howto/trust.md", "pages.trust:measure"),
    "calibrated": ("docs/fidelity.md", "pages.laws:calibrated"),
    "constants": ("docs/theories.md", "pages.laws:constants"),
    "leakage": ("docs/leakage.md", "pages.laws:leakage"),
    "adhesion": ("docs/adhesion.md", "pages.adhesion:adhesion"),
    "export": ("docs/export.md", "pages.export:formats"),
    "gallery": ("docs/tutorials/map.md", "pages.maps:gallery"),
    "machined": ("docs/fidelity.md", "pages.maps:machined"),
    "maps": ("docs/maps.md", "pages.maps:maps"),
    "measured": ("docs/fidelity.md", "pages.measurements:measurements"),
    "metals": ("docs/yield.md", "pages.measurements:metals"),
    "data": ("docs/data/README.md", "pages.simulations:data"),
    "fidelity": ("docs/fidelity.md", "pages.simulations:fidelity"),
    "joints": ("docs/joints.md", "pages.simulations:joints"),
    "tutorials/design": ("docs/tutorials/design.md", "pages.simulations:design"),
    "lubrication": ("docs/leakage.md", "pages.simulations:lubrication"),
    "rough_bodies": ("docs/joints.md", "pages.simulations:rough_bodies"),
    "cost": ("docs/lookup.md", "pages.cost:measure"),
    "guarantees": ("docs/guarantees.md", "pages.stability:measure"),
    # quotes the page of guarantees
    "tables": ("docs/tables.md", "pages.library:tables"),
    "explorer": ("docs/export.md", "explorer:measure"),
    "yield": ("docs/yield.md", "pages.laws:yielding"),
    "unloading": ("docs/yield.md", "pages.unloading:measure"),
}


def measured(name: str) -> Measured:
    module, _, function = PARTS[name][1].partition(":")
    measure = getattr(importlib.import_module(f"generate.{module}"), function)
    parts_and_files: Measured = measure()
    return parts_and_files


class Generator(click.Group):
    """A group of which every known error ends in one line and exit code 2."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*COMMANDS, *super().list_commands(ctx)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in COMMANDS:
            command: click.Command = getattr(
                importlib.import_module(COMMANDS[cmd_name]), cmd_name
            )
            return command
        return super().get_command(ctx, cmd_name)

    def main(self, *args: Any, **extra: Any) -> Any:
        """Run; exit with 0, with 1 where interrupted, or with 2 after an error."""
        extra["standalone_mode"] = False
        try:
            code = super().main(*args, **extra)
        except click.Abort:
            click.echo("generate: interrupted", err=True)
            sys.exit(1)
        except ModuleNotFoundError as fault:
            extras = "wheels" if fault.name == "ziglang" else "generate"
            click.echo(
                f"generate: {fault}; install the extra: pip install -e '.[{extras}]'",
                err=True,
            )
            sys.exit(2)
        except (click.ClickException, MbmaError, OSError, RuntimeError) as fault:
            text = (
                fault.format_message()
                if isinstance(fault, click.ClickException)
                else str(fault)
            )
            click.echo(f"generate: {' '.join(text.split())}", err=True)
            sys.exit(2)
        sys.exit(code if isinstance(code, int) else 0)


@click.group(cls=Generator, context_settings={"help_option_names": ["-h", "--help"]})
def main() -> None:
    """Remake the tables, the closed forms and the pages of the documentation, in a checkout."""


@main.command()
@click.argument("names", nargs=-1, required=True, type=click.Choice([*PARTS, "all"]))
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path, file_okay=False),
    default=ROOT,
    help="The checkout.",
)
def pages(names: tuple[str, ...], out: pathlib.Path) -> None:
    """Write the measured tables and the figures of pages of the documentation."""
    for name in PARTS if "all" in names else names:
        for path in write(PARTS[name][0], *measured(name), out):
            click.echo(path)


if __name__ == "__main__":
    main()
