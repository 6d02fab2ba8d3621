"""`python -m generate machined`: press maps as machines make them, and gather truth and answers into one file."""

import functools
import pathlib
from collections.abc import Callable
from typing import Any, cast

import click
import numpy as np
import xarray as xr

from generate.boundary_elements import run as campaigns
from generate.boundary_elements.run import run
from generate.boundary_elements.solve import simulate_to
from generate.boundary_elements.surfaces import Task
from generate.calibrated_file import variable, write_part
from generate.machined.hardness import ETA, WAYS, yielded
from generate.machined.makers import FAMILIES, Part
from generate.machined.solve import answered, solved, surface_of
from mbma_tables.data import FILE

NUMBERS = 10  # parts of each family
# points a side of one more of each family, and its number: of the longest shortest wavelength
LARGE, SMOOTHEST = 512, 2
EVERY = 3  # part that is pressed with a hardness, too
FORMS = ("calibrated", "corrected", "simulated")
TEXTS = campaigns.TEXTS["groups"]["machined"]


def parts() -> list[Part]:
    """Every part, families in turn, so that stopping early leaves a balanced set; large ones of all but one."""
    large = [Part(family, SMOOTHEST, LARGE) for family in FAMILIES if family != "milled"]
    return [Part(family, number) for number in range(NUMBERS) for family in FAMILIES] + large


def yielding_parts() -> list[Part]:
    """Those that are pressed with a hardness."""
    return parts()[: NUMBERS * len(FAMILIES) : EVERY]


def answers(part: Part, form: str, folder: pathlib.Path) -> dict[str, Any]:
    """A theory's answers of a part that is solved."""
    with np.load(folder / f"{part.name}.npz") as truth:
        return answered(part, form, dict(truth))


def gathered(folder: pathlib.Path) -> xr.Dataset:
    """All parts that are solved and answered."""
    have = [p for p in parts() if all((folder / form / f"{p.name}.npz").exists() for form in FORMS)]
    hard = {p.name: dict(np.load(folder / "hardness" / f"{p.name}.npz")) for p in yielding_parts() if p in have}
    names: dict[str, Any] = {"surface": [part.name for part in have], "family": [part.family for part in have]}
    names |= {"yielding": [*hard], "eta": list(ETA), "way": list(WAYS)}
    over = {name: "surface" if name == "family" else name for name in names}
    data = xr.Dataset(coords={n: variable(over[n], values, TEXTS["names"][n]) for n, values in names.items()})
    engine = ""
    for prefix, place in (("", folder), *((f"{form}_", folder / form) for form in FORMS)):
        read = [dict(np.load(place / f"{part.name}.npz")) for part in have]
        engine = engine or str(read[0]["engine"])
        for name in (name for name in TEXTS["columns"] if name in read[0]):
            values: Any = np.array([one[name] for one in read], "f4")
            data[prefix + name] = variable(("surface", "load"), values, TEXTS["columns"][name])
    for name, meaning in TEXTS["hard"].items():
        values = np.array([one[f"hard_{name}"] for one in hard.values()], "f4")
        ways = ("way",) if values.ndim == 4 else ()
        data[f"hard_{name}"] = variable(("yielding", *ways, "eta", "hard_load"), values, meaning)
    surfaces = [surface_of(part)[1] for part in have]
    known = {name: [getattr(one, name) for one in surfaces] for name in ("h_rms", "skewness", "kurtosis")}
    known |= {name: [getattr(one.bearing, name) for one in surfaces] for name in ("anisotropy", "slope_kurtosis")}
    known["shortest"] = [part.shortest for part in have]
    for name, meaning in TEXTS["surface"].items():
        data[name] = variable("surface", np.array(known[name], float), meaning)
    return data.assign_attrs(campaigns.attributes(TEXTS, {"engine": engine}))


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--folder", type=click.Path(path_type=pathlib.Path), default="machined", show_default=True)
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Processes.")
@click.option("--out", type=click.Path(path_type=pathlib.Path), default=FILE, show_default=True)
def machined(folder: pathlib.Path, workers: int, out: pathlib.Path) -> None:
    """Press maps of machined surfaces by boundary elements (Tamaas): an hour on one core.

    Stopped and called again, it goes on where it was. Answers of theories are kept in folders of their own: remove
    these to ask a changed library again.
    """
    from generate.workers import executor

    tasks: list[Any] = [Task(cast(Any, part), "") for part in parts()]
    solvers: dict[str, Callable[[Part], dict[str, Any]]] = {"": solved}
    solvers |= {form: functools.partial(answers, form=form, folder=folder) for form in FORMS}
    hard: list[Any] = [Task(cast(Any, part), "") for part in yielding_parts()]
    with executor(workers) as pool:
        run(hard, folder / "hardness", pool, functools.partial(simulate_to, solve=cast(Any, yielded)))
        for form, solve in solvers.items():
            run(tasks, folder / form, pool, functools.partial(simulate_to, solve=cast(Any, solve)))
    data = gathered(folder)
    write_part(out, data, "machined")
    click.echo(f"{out}: {data.sizes['surface']} of {len(tasks)} surfaces")
