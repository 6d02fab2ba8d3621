"""Measured contacts beside the library, with the bands of what the reports do not state; names of metals."""

import csv

import numpy as np

from generate import distances
from generate.page import Cell, Measured, table
from mbma_tables import Bodies, Joint, contact
from mbma_tables.common.files import shipped_file
from mbma_tables.common.plots import new_figure, number_ticks

# W/(m^2 K), within 10%, at pressures [MPa] of ground steel on steel in air; roughness and steel
# not stated. Autodesk Moldflow Insight, help on interface conductance
GROUND = {7.0: 21_000.0, 15.0: 38_000.0}
WITHIN = 0.1
# what ground faces have, typical values of docs/surfaces.md [um]
ANY_RA = "0.1..1.6 um"
FACES = {
    "Ra and process not stated": {"Ra": ANY_RA, "process": "unknown"},
    "ground, Ra not stated": {"Ra": ANY_RA, "process": "ground"},
    "ground, Ra 0.8 um": {"Ra": "0.8 um", "process": "ground"},
}
# of one interface at 70 MPa, stiffness by ultrasound over that by image correlation
RATIO = 3.0
RATIO_AT = "70 MPa"
RATIO_METALS = ("titanium Ti-6Al-4V", "steel S235 hard")
EXPONENT_METALS = ("aluminium 6061 hard", "stainless steel 304 soft")
# p/E* between which the printed surface of the challenge was pressed; its gradient is 1
PRINTED = (0.001, 1.0)
DRAWS = 400


def joint(face: dict[str, str], metal: str = "steel 1020") -> Joint:
    """Two faces alike, of a few square centimetres."""
    return Joint(face, face, bodies=metal, nominal_area="1..10 cm^2")


def conductances() -> tuple[str, dict[str, object]]:
    """A table of the conductance of ground steel, and its picture."""
    measured = [f"{value:,.0f} +- 10%" for value in GROUND.values()]
    rows: list[list[Cell]] = [["measured", *measured, None]]
    figure = new_figure(6.0, 4.0)
    axis = figure.add_subplot()
    pressures = np.geomspace(2.0, 30.0, 7)
    for (name, face), colour in zip(FACES.items(), ("C7", "C0", "C2"), strict=True):
        found = joint(face).uncertainty(
            [f"{p} MPa" for p in (*GROUND, *pressures.tolist())],
            draws=DRAWS,
            quantities=["total_conductance"],
        )
        low, median, high = found.quantiles["total_conductance"]
        cells = [
            f"{low[k]:,.0f} to {high[k]:,.0f} ({median[k]:,.0f})"
            for k in range(len(GROUND))
        ]
        valid = "yes" if found.valid.all() else "no"
        rows.append([name, *cells, valid])
        beyond = slice(len(GROUND), None)
        axis.fill_between(pressures, low[beyond], high[beyond], color=colour, alpha=0.2)
        axis.plot(pressures, median[beyond], color=colour, label=name)
    values = np.array([*GROUND.values()])
    axis.errorbar(
        [*GROUND], values, WITHIN * values, fmt="ko", capsize=3, label="measured"
    )
    axis.set(xscale="log", yscale="log", xlabel="pressure F/A0 [MPa]")
    axis.set_ylabel("total conductance [W/(m$^2$ K)]")
    number_ticks(axis)
    axis.legend(fontsize="small")
    header = ["known of the faces", *(f"{p:g} MPa" for p in GROUND), "valid"]
    parts = table(" | ".join(header), rows)
    return parts, {"docs/figures/measured_conductance.svg": figure}


def ratios() -> str:
    """Unloading over loading stiffness of pairs of metals, where the faces are not stated."""
    rows: list[list[Cell]] = [["measured", f"about {RATIO:g}"]]
    for metal in RATIO_METALS:
        faces = joint({"Ra": "0.4..3.2 um", "process": "ground"}, metal)
        found = [
            replica.at_pressure(RATIO_AT).contact for replica in faces.replicas(DRAWS)
        ]
        ratio = np.array(
            [float(each.unloading_stiffness / each.stiffness) for each in found]
        )
        low, median, high = np.quantile(ratio, (0.05, 0.5, 0.95))
        rows.append([metal, f"{low:.2f} to {high:.2f} ({median:.2f})"])
    header = "metal | unloading over loading stiffness, 5% to 95% (median)"
    return table(header, rows)


def exponents() -> str:
    """The exponent of the pressure in the conductance of the solid spots, between 1 and 10 MPa."""
    rows: list[list[Cell]] = [["measured", "0.73"]]
    for metal in EXPONENT_METALS:
        faces = joint(FACES["ground, Ra not stated"], metal)
        # without the spread of the law at one load, which both loads share
        found = [
            np.ravel(replica.at_pressure(["1 MPa", "10 MPa"]).contact.solid_conductance)
            for replica in faces.replicas(DRAWS)
        ]
        exponent = np.log10([each[1] / each[0] for each in found])
        low, median, high = np.quantile(exponent, (0.05, 0.5, 0.95))
        rows.append([metal, f"{low:.2f} to {high:.2f} ({median:.2f})"])
    return table("metal | exponent of the pressure, 5% to 95% (median)", rows)


def printed() -> str:
    """Contact areas of the spectrum of the contact-mechanics challenge, with twice the scatter."""
    own = distances.older("challenge").surface
    found = contact(
        own,
        Bodies(1.0, hardness=np.inf),
        pressure=np.array(PRINTED) * float(own.rms_gradient),
        theory="calibrated",
    )
    spread = np.exp(2 * np.ravel(found.area_scatter))
    rows: list[list[Cell]] = [["measured", "from 0.1%", "to 60%"]]
    cells = [
        f"{100 * area / factor:.2g} to {100 * min(area * factor, 1.0):.2g}%"
        for area, factor in zip(np.ravel(found.area), spread, strict=True)
    ]
    rows.append(["calibrated law, two scatters", *cells])
    header = " | ".join(f"p/E* = {pressure:g}" for pressure in PRINTED)
    return table(f"area | {header}", rows)


def measurements() -> Measured:
    """Blocks and the picture of the page of measurements."""
    conductance, files = conductances()
    blocks = {
        "conductance": conductance,
        "ratios": ratios(),
        "exponents": exponents(),
        "printed": printed(),
    }
    return blocks, files  # type: ignore[return-value]


def metals() -> Measured:
    """All names of metals, with the numbers and where they were read."""
    rows = list[list[Cell]]()
    text = shipped_file("metals.csv").read_text(encoding="utf-8").splitlines()
    for row in csv.DictReader(line for line in text if not line.startswith("#")):
        numbers = f"{row['E']}, {row['nu']}"
        hardness = f"{row['soft']} to {row['hard']} {row['scale']}"
        conductivity = f"{row['low']} to {row['high']}"
        if row["low"] == row["high"]:
            conductivity = row["low"]
        names = row["also"].replace(";", "; ")
        rows.append([row["name"], names, numbers, hardness, conductivity, row["source"]])
    header = "name | other names | E [GPa], nu | hardness | W/(m K) | read at"
    return {"names": table(header, rows)}, {}
