"""``python -m generate score``: deviations of theories from the held-out simulations of the data set."""

import functools
import pathlib
import runpy
import types
from typing import Any

import click

from generate.boundary_elements.evidence import TheoryCurve
from generate.distances import RANGES, distances, held_out, summed_up
from generate.files import ROOT
from generate.page import percent, table
from mbma_tables.common.errors import InputError

HEADER = "theory | area at given pressure | pressure at given gap | stiffness at given pressure | loads reached"
OTHERS = ROOT / "generate" / "theories_of_others.py"
FUNCTIONS = ("answer", "at_pressure")


def theories_of(path: pathlib.Path) -> dict[str, Any]:
    """Theories of a Python file by name: objects that have a name, or the file's own function, named as the file.

    A theory has ``answer(surface, mean_separation)``, which returns F/(A0 E*) and A/A0, or
    ``at_pressure(surface, pressure)``, which returns A/A0 and the mean separation.
    """
    content = runpy.run_path(str(path))
    found = {
        one.name: one
        for one in content.values()
        if any(hasattr(one, function) for function in FUNCTIONS) and not isinstance(one, type | types.ModuleType)
    }
    if own := {name: content[name] for name in FUNCTIONS if callable(content.get(name))}:
        found[content.get("name", path.stem)] = types.SimpleNamespace(**own)
    if not found:
        raise InputError(
            f"{path} must have a function answer(surface, mean_separation) or at_pressure(surface, pressure), "
            f"or objects with a name and one of these; it has {sorted(name for name in content if name[0] != '_')}"
        )
    return found


def scores(theories: dict[str, Any]) -> str:
    """A table of theories, as objects or as functions of a `Case`, on all held-out self-affine surfaces."""
    seen, rows = held_out(), []
    for name, one in theories.items():
        found = distances(seen, one if isinstance(one, types.FunctionType) else functools.partial(TheoryCurve, one))
        sums = [[summed_up(seen, values, *ends) for ends in RANGES] for values in found.values()]
        cells = [[rms for rms, _ in own] for own in sums] + [[reached for _, reached in sums[0]]]
        rows.append([name, *(" / ".join(map(percent, values)) for values in cells)])
    return table(HEADER, rows)


@click.command()
@click.argument("path", type=click.Path(path_type=pathlib.Path, exists=True, dir_okay=False))
def score(path: pathlib.Path) -> None:
    """Print how far the theories of the Python file PATH are from boundary elements.

    Root mean squares of ln(theory/simulation) in percent, at 1-10% / 10-97% contact, on the surfaces of which none was
    used in a fit; docs/data.md describes PATH.
    """
    click.echo(scores(theories_of(path)))
