"""How far each kind of answer is from simulations: the table of docs/howto/trust.md."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from generate import distances
from generate.machined import profiles, raw_maps
from generate.page import Cell, Measured, as_error, table
from mbma_tables.common.arguments import FloatArray
from mbma_tables.surfaces.roughness import processes

SHARE = 0.9  # of the errors that lie below the numbers of the table
DATA_SETS = ("spectra", "surfaces")  # that no fit saw
THEORIES = {"calibrated": "calibrated", "Persson": "persson", "MBMA reported": "mbma"}
NUMBERS = "five numbers or a spectrum, of a Gaussian and isotropic face"


def measure() -> Measured:
    rows = [*_of_numbers(), _of_maps(), _of_traces(), _of_drawings()]
    header = (
        "given | theory | contacts or maps compared | area at given pressure"
        " | pressure or gap | stiffness at given pressure"
    )
    return {"kinds": table(header, rows)}, {}


def _error(errors: Sequence[float] | FloatArray | pd.Series) -> str:
    values = np.abs(np.asarray(errors, dtype=float))
    return as_error(float(np.quantile(values[np.isfinite(values)], SHARE)))


def _of_numbers() -> Iterator[list[Cell]]:
    sets = distances.data_sets()
    seen = [case for name in DATA_SETS for case in sets[name].seen]
    area = np.concatenate([case.area for case in seen])
    compared = (area >= distances.LOW) & (area <= distances.HIGH)
    for title, name in THEORIES.items():
        errors = distances.distances(seen, distances.THEORIES[title])
        cells = [
            _error(errors[quantity][compared])
            for quantity in ("area", "force", "stiffness")
        ]
        area_error, force_error, stiffness_error = cells
        yield [
            NUMBERS,
            f"`{name}`",
            f"{compared.sum()} contacts of {len(seen)} surfaces",
            area_error,
            f"pressure {force_error}",
            stiffness_error,
        ]


def _of_maps() -> list[Cell]:
    data = pd.read_csv(raw_maps.FILE)
    data = data[(data.times == 1) & (data.valid == 1)]
    errors = {name: _error(found) for name, (found, _) in raw_maps.errors(data).items()}
    maps = data.groupby(["kind", "number"]).ngroups
    return [
        "a map",
        "`simulated`",
        f"{len(data)} contacts of {maps} maps",
        errors["area"],
        f"pressure {errors['pressure']}",
        errors["stiffness"],
    ]


def _of_traces() -> list[Cell]:
    data = pd.read_csv(profiles.FILE)
    data = data[data.valid == 1]
    errors = {name: _error(found) for name, found in data.error.groupby(data.quantity)}
    return [
        "traces, isotropic or with traces across, of Gaussian heights",
        "`calibrated`",
        f"{len(data) // len(errors)} contacts by traces",
        errors["area"],
        f"gap {errors['mean_separation']}",
        errors["stiffness"],
    ]


def _of_drawings() -> list[Cell]:
    """Least and largest root mean square of the processes that maps were compared for."""
    rows = [row for row in processes().values() if int(row["maps"])]
    ranges = []
    for name in ("area", "gap", "stiffness"):
        spreads = [float(row[f"{name}_spread"]) for row in rows]
        ranges.append(f"{as_error(min(spreads))} to {as_error(max(spreads))}")
    area, gap, stiffness = ranges
    maps = sum(int(row["maps"]) for row in rows)
    return [
        "Ra and a process (root mean square, by process)",
        "`calibrated`",
        f"{maps} maps of {len(rows)} processes",
        area,
        f"gap {gap}",
        stiffness,
    ]
