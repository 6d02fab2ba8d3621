"""The commands `mbma contact`, `curve`, `sensitivity`, `island`, `fit` and `cost`."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.cli import options
from mbma_tables.cli.format import Report, column_unit, columns_of, report_answer, to_json
from mbma_tables.common.arguments import finite_array
from mbma_tables.common.distributions import distribution_of
from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.common.files import shipped_file
from mbma_tables.common.progress import echo
from mbma_tables.contacts.quantities.gas import GASES, VACUUM
from mbma_tables.contacts.quantities.registry import unit_of
from mbma_tables.contacts.question import PRESCRIBED
from mbma_tables.design.specimen import Specimen

if TYPE_CHECKING:
    from mbma_tables.contacts.result import Contact

LIGHTEST = 1e-4  # A/A0 at a curve's second point
SEARCHED = 1 - np.append(
    np.geomspace(1e-3, 0.2, 60), np.linspace(0.2, 2.0, 141)[1:]
)  # d/h_max where areas are found
MIN_POINTS = 5
DRAWN = (
    "calibrated",
    "persson",
)  # theories shown beside the chosen one in a picture, where available
MEASURED = ("h_rms", "h_max", "rms_gradient", "skewness", "kurtosis", "anisotropy")
ISLAND_FIELDS = ("zeta_d", "zeta_u", "R_d", "R_u", "D", "sigma", "h_d", "eta", "X", "mu")


def _resolution(pressed: Any) -> list[str]:
    """A line on what the shortest wavelengths of a simulated map do to its contact, if that can be simulated."""
    has_map = getattr(pressed.surface, "map", None) is not None
    if not has_map or pressed.yields:
        return []
    from mbma_tables.contacts.resolution import last_octave

    with contextlib.suppress(MbmaError):
        return [last_octave(pressed).statement()]
    return []


@click.command(
    "contact", short_help="Pressure and area at given gaps, pressures or areas."
)
@options.load_options(options.numbers_option)
@options.leakage_option
@options.columns_option
@options.conductivity_option
@options.draws_options
@options.optional_specimen_options
@options.theory_options
@options.output_options
def contact_command(
    loads: dict[str, list[Any]],
    leakage: bool,
    quantity: list[str] | None,
    conductivity: list[Any] | None,
    drawn: dict[str, Any],
    specimen: dict[str, Any],
    model: options.Model,
    output: options.Output,
) -> None:
    """Pressure, real contact area and stiffness -dF/du at given gaps, pressures or areas.

    Plain numbers are in the units of the surface and of the modulus, "0.8um" is converted
    to them. Force is F/(A0 E*), or F/A0 where a modulus is given; area is A/A0.

    At a pressure any number may be a range, '0.25..2.5 mm', a mean with its deviation,
    '1.6 um +- 0.2 um', or measured values, '{measured = ["1.5 um", "1.7 um"]}': the table
    then has medians with quantiles 5% and 95%, and lines above it the shares of inputs.

    Example: mbma contact --surface challenge --E-star 25MPa --length-unit mm -p 100kPa

    Example: mbma contact --Ra '1.6 um +- 0.2 um' --hurst 0.8 --longest 0.8mm --shortest 8um
    --nominal-area 4cm^2 --E-star 115GPa --hardness 2..3GPa -p 10MPa
    """
    if len(loads) != 1:
        raise InputError(
            "one of --separation, --mean-separation, --pressure and --area is needed"
        )
    ((name, numbers),) = loads.items()
    from mbma_tables.cli.format import quantiles_of_surface
    from mbma_tables.cli.ranges import quantiles_of, typed_of

    typed = typed_of(specimen, model, conductivity)
    central = typed.central
    model = model.of(central.surface, name)
    if typed.has_range or any(distribution_of(name, each) for each in numbers):
        if leakage:
            raise InputError("--leakage is of known numbers: --quantity flow_coefficient")
        found = quantiles_of(typed, loads, model, quantity or (), drawn)
        quantiles_of_surface("contact", central, model.theory.name, found).write(output)
        return
    if drawn:
        raise InputError("--draws and --seed are of numbers that are ranges, and none is")
    _contact_of(central, name, numbers, (leakage, quantity, conductivity), model, output)


def _contact_of(
    specimen: Specimen,
    name: str,
    numbers: list[float | str],
    columns: tuple[bool, list[str] | None, list[float | str] | None],
    model: options.Model,
    output: options.Output,
) -> None:
    """Write the contact of known numbers."""
    from mbma_tables.contacts.contact import contact

    leakage, quantity, conductivity = columns
    load = {name: finite_array(name, specimen.units.number(name, numbers))}
    pressed = contact(
        specimen.surface,
        model.bodies(specimen, conductivity),
        theory=model.theory,
        **load,
    )
    values, units = columns_of(pressed, asked=quantity or ())
    if leakage:
        flow, units_of_flow = _leakage(pressed)
        values |= flow
        units |= units_of_flow
    report = report_answer("contact", specimen, model, pressed, values, units)
    report.notes.extend(_resolution(pressed))
    report.write(output)


def _leakage(answer: Contact) -> tuple[dict[str, Any], dict[str, str]]:
    """Columns of the flow coefficient of the gaps, and their units."""
    found = answer.leakage
    values = {
        "leakage": found.K,
        "leakage_scatter": found.scatter,
        "leakage_valid": found.valid,
    }
    return values, dict.fromkeys(values, "-") | {"leakage": found.units["K"]}


@click.command(
    "curve", short_help="Pressure and area from first contact to full compression."
)
@click.option(
    "--points",
    type=click.IntRange(min=MIN_POINTS),
    default=41,
    show_default=True,
    help="How many gaps.",
)
@options.leakage_option
@options.columns_option
@options.conductivity_option
@options.plot_option
@options.specimen_options
@options.theory_options
@options.output_options
def curve_command(
    points: int,
    leakage: bool,
    quantity: list[str] | None,
    conductivity: list[float | str] | None,
    plot: Path | None,
    specimen: Specimen,
    model: options.Model,
    output: options.Output,
) -> None:
    """Quantities of contact against the mean separation, from first contact (u = h_max) to full compression (u = 0).

    Contact areas are geometric, from 0.01% to the largest, between first contact and full
    compression. Gaps where a theory has no finite force are omitted.

    The picture has Persson's theory beside the chosen one, and the calibrated law with its
    scatter as a band.

    Example: mbma curve --surface concrete --plot concrete.png
    """
    options.check_plot(plot, output.out)
    from mbma_tables.common import plots
    from mbma_tables.contacts.contact import contact, contact_where_finite

    model = model.of(specimen.surface)
    surface = specimen.surface
    bodies = model.bodies(specimen, conductivity)
    theory = model.theory
    gap = float(surface.h_max) * SEARCHED
    elastic = Bodies(1.0).in_units(surface)
    at_all = contact_where_finite(surface, elastic, gap, theory)
    gap = gap[np.isfinite(at_all.pressure)]
    area = np.asarray(contact(surface, bodies, separation=gap, theory=theory).area)
    rising = slice(np.flatnonzero(area > 0)[0], int(area.argmax()) + 1)
    wanted = np.geomspace(
        max(LIGHTEST, 1.5 * area[rising][0]), area[rising][-1], points - 1
    )
    inner = np.interp(np.log(wanted[:-1]), np.log(area[rising]), gap[rising])
    gap = np.concatenate([[surface.h_max], inner, gap[-1:]])
    answer = contact(surface, bodies, separation=gap, theory=theory)
    values, units = columns_of(answer, asked=quantity or ())
    if leakage:
        flow, units_of_flow = _leakage(answer)
        values |= flow
        units |= units_of_flow
    picture = b""
    if plot is not None:
        title = specimen.title + (f", hardness {model.hardness}" if model.yields else "")
        curves = [answer.curve(leakage)]
        for name in DRAWN:
            if name != theory.name:
                other = contact_where_finite(surface, answer.bodies, gap, name)
                curves.append(other.curve())
        labels = plots.pressure_label(unit_of("pressure", specimen.units))
        of_flow = plots.leakage_label(unit_of("flow_coefficient", specimen.units))
        picture = plots.to_picture(
            plots.draw_compression(curves, title, labels, leakage_label=of_flow),
            plot.suffix[1:],
        )
    report = report_answer("curve", specimen, model, answer, values, units)
    report.write(output, plot, picture)


@click.command("sensitivity", short_help="Sensitivity of results to each parameter.")
@options.load_options(options.numbers_option)
@options.results_option
@options.conductivity_option
@click.option(
    "--gas",
    type=click.Choice(sorted((*GASES, VACUUM))),
    help="In the gaps: with a conductivity adds gas and total conductance.",
)
@options.specimen_options
@options.theory_options
@options.json_option("a table")
def sensitivity_command(
    loads: dict[str, Any],
    quantity: list[str] | None,
    conductivity: list[float | str] | None,
    gas: str | None,
    specimen: Specimen,
    model: options.Model,
    as_json: bool,
) -> None:
    """d ln(result)/d ln(parameter) of force, area, stiffness and others, the given quantity held fixed.

    Parameters are the surface's five numbers, or those of a drawing; of a map or a spectrum
    the scales of its heights and lengths; of a spectrum also h_max, cut-offs and the
    exponent of an extrapolation.

    Several pressures have a table each.

    Example: mbma sensitivity --surface concrete --E-star 13.3MPa -p 100kPa
    """
    from mbma_tables.contacts.question import name_of_the_given
    from mbma_tables.design.sensitivity import sensitivity

    given = dict.fromkeys(PRESCRIBED) | {
        name: values[0] if len(values) == 1 else values for name, values in loads.items()
    }
    model = model.of(specimen.surface, name_of_the_given(given))
    found = sensitivity(
        specimen.surface,
        model.bodies(specimen, conductivity),
        gas=gas,
        theory=model.theory,
        quantities=quantity,
        **given,
    )
    units = {
        name: column_unit(found.unit(name))
        for name in (*found.parameters, *found.answers)
    }
    if as_json:
        content = {
            "by": found.by,
            "parameters": found.parameters,
            "answers": found.answers,
            "slopes": found.slopes,
            "errors": found.errors,
            "derivatives": found.derivatives,
            "sides": found.sides,
            "theory": model.theory.name,
            "units": units,
        }
        echo(to_json(content))
        return
    head = f"mbma sensitivity: {specimen.title}, theory {model.theory.name}"
    if found.shape == ():
        here = ", ".join(
            f"{name} {value:.6g} {units[name]}".removesuffix(" -")
            for name, value in found.answers.items()
        )
        head += f"\nhere: {here}"
    echo(f"{head}\n\n{found}")


@click.command("island", short_help="Contact islands at given approaches.")
@options.numbers_option(
    "--delta", help="Approach z_max - d of an island [length], positive; may be repeated."
)
@options.specimen_options
@options.model_options
@options.output_options
def island_command(
    delta: list[float | str] | None,
    specimen: Specimen,
    model: options.Model,
    output: options.Output,
) -> None:
    """Band, radii, densities, force and area of contact islands at given approaches.

    Force is F/E*, or F where a modulus is given.

    Example: mbma island --surface concrete --delta 0.1,0.3
    """
    if delta is None:
        raise InputError("approaches are needed: --delta")
    from mbma_tables.theories.mbma.island import island

    model = model._replace(theory="mbma").of(specimen.surface)
    answer = island(
        specimen.surface,
        finite_array("delta", specimen.units.number("delta", delta)),
        island_model=model.island_model,
        variant=model.variant,
        E_star=specimen.modulus,
        rtol=model.rtol,
    )
    values = {
        name: getattr(answer, name)
        for name in ("delta", *ISLAND_FIELDS, "force", "area", "error")
    }
    units = {
        name: unit_of(f"island_{name}", specimen.units) for name in ("force", "area")
    }
    report_answer("island", specimen, model, answer, values, units).write(output)


@click.command("fit", short_help="Evaluate a measured map or line scan, and its contact.")
@click.argument(
    "measurements",
    metavar="MAP...",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path),
)
@options.quantity_option(
    "--E-star", "E_star", help="Effective modulus; without one pressures are over E*."
)
@options.plot_option
@click.option(
    "--simulate",
    is_flag=True,
    help="Simulate the map by boundary elements; --out OWN.nc stores results.",
)
@options.map_options
@options.output_options
def fit_command(
    measurements: tuple[Path, ...],
    E_star: Any,
    plot: Path | None,
    simulate: bool,
    treatment: dict[str, Any],
    output: options.Output,
) -> None:
    """Read a map or line scan; report its properties and treatment, and its contact with a flat.

    The table is by the default theory of mbma contact, with its distance from boundary
    elements (scatter: standard deviation of ln A at a pressure and of ln F at a
    separation). The picture has the map, its spectrum, its heights, and area and separation
    against pressure by the calibrated law and MBMA.

    Several maps are scans of one surface: spectra, heights and curves are averaged, and the
    picture shows the first.

    With --simulate the table is by boundary elements on the map itself, and --out OWN.nc
    writes them, a table of the surface that --map OWN.nc of other commands reads in place
    of the map.

    Example: mbma fit wafer.sur --short-cutoff 2um --plot wafer.png
    """
    options.check_plot(plot, output.out)
    from mbma_tables.common.plots import pressure_label, to_picture
    from mbma_tables.common.units import Units
    from mbma_tables.contacts.measurement import (
        areal,
        curves,
        described,
        draw,
        table_of_loads,
    )
    from mbma_tables.design.specimen import effective_modulus_of, measured
    from mbma_tables.surfaces.averages import average
    from mbma_tables.theories import Simulated, default_name, resolve

    modulus, stress_unit = effective_modulus_of(
        {} if E_star is None else {"E_star": E_star}
    )
    scans = [measured(path, treatment) for path in measurements]
    surface = scans[0][1] if len(scans) == 1 else average([scan for _, scan in scans])
    scale = 1.0 if modulus is None else modulus
    full = Simulated(grid="full")
    theory = full.name if simulate else default_name(surface, "area")
    tabulated = full if simulate else theory
    columns, told = table_of_loads(surface, scale, tabulated)
    if simulate and output.out is not None and output.out.suffix == ".nc":
        full.of(surface).to_netcdf(output.out)
        told = [*told, f"{output.out} has the simulation"]
        output = output._replace(out=None)
    units = Units(surface.unit, "1" if modulus is None else stress_unit)
    facts: dict[str, Any] = {name: getattr(surface, name) for name in MEASURED} | {
        "areal": areal(surface)
    }
    facts |= {"theory": theory, "length_unit": surface.unit, "stress_unit": stress_unit}
    facts |= {"provenance": surface.provenance, "notes": told}
    title = ", ".join(path.name for path in measurements)
    own = {name: unit_of(name, units) or "-" for name in columns} | {"area": "A/A0"}
    picture = b""
    if plot is not None:
        label = pressure_label(unit_of("pressure", units))
        picture = to_picture(
            draw(scans[0][0], surface, curves(surface, scale), title, label),
            plot.suffix[1:],
        )
    departures = resolve(tabulated, surface, "area").departures(surface)
    notes = [*described(surface, departures), f"table by theory {theory}", *told]
    Report("fit", title, notes, facts, columns, own).write(output, plot, picture)


@click.command("cost", short_help="Computing time against accuracy.")
@click.option(
    "--distance",
    is_flag=True,
    help="Theories' deviation from simulation instead of numerical error.",
)
@options.json_option("a table")
def cost_command(distance: bool, as_json: bool) -> None:
    """Error and time of every method, as measured on held-out surfaces.

    Costs are times relative to that of a fixed piece of work; seconds are those of the
    machine of the measurement. See docs/lookup.md. With --distance: root mean squares of
    ln(theory/boundary elements), of area at equal force and force at equal separation,
    light at 1-10% contact and deep at 10-97%.

    Example: mbma cost --distance
    """
    from mbma_tables.design.scenes.plan import UNIT, measurements, shipped_costs

    costs = shipped_costs()
    rows = measurements(shipped_file("distance.csv")) if distance else costs.rows
    unit = costs.seconds
    records = [
        row | {"seconds": row["cost"] * unit}
        for row in rows
        if row.get("island_model") != UNIT
    ]
    if as_json:
        echo(to_json({"unit_seconds": unit, "rows": records}))
        return
    columns = {name: [record[name] for record in records] for name in records[0]}
    title = "distance" if distance else "cost"
    echo(
        Report(title, f"fixed piece of work {unit:.3g} s", [], {}, columns).to_table(),
        nl=False,
    )
