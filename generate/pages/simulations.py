"""The library beside simulations and published fits: joints, lubrication, rough bodies, fidelity, and the data set."""

import itertools
from collections.abc import Iterable
from typing import Any

import numpy as np

from generate import distances
from generate.boundary_elements.run import LIGHT_BINS, compared, surfaces
from generate.calibrated_file import QUANTITIES, binned, by_bin
from generate.files import dataset
from generate.page import Measured, panels, percent, table
from generate.rough_spheres import RADIUS, heights
from mbma_tables import Joint, Surface, flow_factors, rough_contact
from mbma_tables.bodies import mean_conductivity
from mbma_tables.common.arguments import FloatArray
from mbma_tables.data import boundary_elements
from mbma_tables.quantities.conductances import cooper_mikic_yovanovich
from mbma_tables.rough_body.rough_contact import mean_wavelength

PAIRS = {
    "steel on aluminium": ("steel 4140 hard", "aluminium 6061 hard"),
    "copper on copper": "copper C11000 hard",
}
SHORTEST, PRESSURES = ("8 um", "2 um"), (1.0, 10.0, 100.0)  # MPa
# C and r of phi_x = 1 - C exp(-r H), or 1 + C H^-r from gamma = 3 on: Patir and Cheng 1978, Table 1
PATIR_CHENG = {1 / 9: (1.48, 0.42), 1 / 6: (1.38, 0.42), 1 / 3: (1.18, 0.42), 1.0: (0.90, 0.56), 3.0: (0.225, 1.5),
               6.0: (0.520, 1.5), 9.0: (0.870, 1.5)}  # fmt: skip
FIRST, LAST = (
    3.0,
    6.0,
)  # u/h_rms between which fits are compared: where there is no contact, and where they end
SMOOTH = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=1.0, h_max=2.9)
WIDTHS = (1.0, 2.0, 3.0, 4.5, 7.0, 20.0)  # of the contact over the mean wavelength
FACE = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=0.5, h_max=1.75, unit="um")


def conductances(one: Joint, pressure: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Conductance of the solid [W/(m^2 K)] at pressures [MPa], by the law and by the correlation."""
    assert one.pair is not None
    k = mean_conductivity(*(float(text.split()[0]) for text in one.pair.conductivities))
    assert one.pair.hardness is not None
    hardness = 1e3 * float(one.pair.hardness.split()[0])
    law = one.at_pressure([f"{p} MPa" for p in pressure]).conductance
    return np.asarray(law), 1e6 * np.asarray(
        cooper_mikic_yovanovich(one.surface, pressure, k, 1.0, hardness)
    )


def joints() -> Measured:
    """Stiffness at light loads against boundary elements, conductance against a usual correlation."""
    by_waves, lines = dict[int, list[FloatArray]](), []
    for one in surfaces(dataset("light_loads")):
        by_waves.setdefault(int(one.waves), []).append(compared(one))
    for waves, parts in by_waves.items():
        area, stiffness, _ = np.concatenate(parts, axis=1)
        bins = binned(area, stiffness, LIGHT_BINS)
        lines.append(
            [
                str(waves),
                *(
                    f"{part.mean():+.2f} ± {part.std():.2f}" if part.size else ""
                    for part in bins
                ),
            ]
        )
    contacts = " | ".join(
        f"{low:.2%} to {high:.2%}" for low, high in itertools.pairwise(LIGHT_BINS)
    )

    figure, axes = panels(size=(6.5, 4))
    usual, pressure = [], np.geomspace(0.1, 300, 40)
    for (name, materials), shortest in itertools.product(PAIRS.items(), SHORTEST):
        face = {"hurst": 0.8, "longest": "250 um", "shortest": shortest}
        joint = Joint(
            face | {"Rq": "1.6 um"},
            face | {"Rq": "0.8 um"},
            bodies=materials,
            nominal_area="4 cm^2",
        )
        pairs = zip(*conductances(joint, np.array(PRESSURES)), strict=True)
        usual.append([name, shortest, *(f"{a:.3g}, {b / a:.2f}" for a, b in pairs)])
        law, correlation = conductances(joint, pressure)
        (line,) = axes.loglog(pressure, law, label=f"{name}, {shortest}")
        axes.loglog(pressure, correlation, "--", color=line.get_color())
    axes.set(
        xlabel="pressure [MPa]",
        ylabel="conductance [W/(m² K)]",
        title="law; dashed: Cooper-Mikic-Yovanovich",
    )
    axes.legend(fontsize=7)
    header = (
        f"joint | shortest wavelength | {' | '.join(f'{p:g} MPa' for p in PRESSURES)}"
    )
    blocks = {
        "light": table(f"longest wavelengths a side | {contacts}", lines),
        "usual": table(header, usual),
    }
    return blocks, {"docs/figures/joints.svg": figure}


def published(gamma: float, H: FloatArray) -> FloatArray:
    C, r = PATIR_CHENG[gamma]
    return 1 + C * H**-r if gamma > 1 else 1 - C * np.exp(-r * H)


def lubrication() -> Measured:
    H, rows = np.linspace(FIRST, LAST, 61), []
    figure, (left, right) = panels(1, 2, (10, 4))
    u = np.geomspace(0.5, 10, 120)
    for number, gamma in enumerate(PATIR_CHENG):
        peklenik = min(max(gamma, 1 / 8.5), 8.5)
        known, found = (
            published(gamma, H),
            flow_factors(SMOOTH, H, peklenik=peklenik).phi_x,
        )
        name = f"{gamma:g}" if gamma >= 1 else f"1/{1 / gamma:g}"
        off = np.log(found / known)
        rows.append([name, np.sqrt(np.mean(off**2)), off[np.abs(off).argmax()]])
        film = flow_factors(SMOOTH, u, peklenik=peklenik)
        left.semilogx(u, film.phi_x, color=f"C{number}", label=name)
        left.semilogx(H, known, "o", ms=2, markevery=5, color=f"C{number}")
        right.semilogx(u, film.shear_x, color=f"C{number}")
    left.set(xlabel="u/h_rms", ylabel="phi_x (points: Patir and Cheng 1978)", ylim=(0, 2))
    right.set(xlabel="u/h_rms", ylabel="phi_s")
    left.legend(title="gamma", fontsize="small")
    parts = {
        "published": table(
            "gamma | root mean square of ln ratio | largest",
            rows,
            "{} | {:.3f} | {:+.3f}",
        )
    }
    return parts, {"docs/figures/lubrication.svg": figure}


def spheres() -> dict[str, FloatArray]:
    """Every simulated contact, and the library's at the same approach and force."""
    parts, contacts = [], dataset("rough_spheres").to_dataframe()
    for (hurst, longest, h_rms, seed), rows in contacts.groupby(
        ["hurst", "longest", "h_rms", "seed"]
    ):
        face = Surface.from_map(
            heights(hurst, longest, h_rms, int(seed)), 1.0, periodic=True
        )
        force, approach, area, radius = (
            rows[n].to_numpy() for n in ("force", "approach", "area", "mean_radius")
        )
        same, pushed = (
            rough_contact(face, RADIUS, force=force),
            rough_contact(face, RADIUS, approach=approach),
        )
        p, r = same.pressure, same.position
        found = {
            "width": 2 * same.contact_radius / mean_wavelength(face),
            "off": (same.approach - approach) / h_rms,
            "force": np.log(pushed.force / force),
            "area": np.log(same.area / area),
            "mean_radius": np.log(
                np.trapezoid(p * r**2, r) / np.trapezoid(p * r, r) / radius
            ),
            "scatter": pushed.scatter,
            "valid": pushed.valid,
        }
        parts.append(found)
    return {
        name: np.concatenate([np.asarray(part[name]) for part in parts])
        for name in parts[0]
    }


def rough_bodies() -> Measured:
    """Distances from boundary elements by the width of the contact, and the curves of one ball."""
    seen, rows = spheres(), []
    for low, high in itertools.pairwise(WIDTHS):
        mine = (seen["width"] >= low) & (seen["width"] < high)
        off, valid = seen["off"][mine], mine & (seen["valid"] > 0)
        cells = [
            f"{low:g} to {high:g}",
            int(mine.sum()),
            (off.mean(), off.std(), np.abs(off).max()),
        ]
        cells += [
            (v.mean(), v.std())
            for v in (seen[name][mine] for name in ("force", "area", "mean_radius"))
        ]
        within = [
            np.mean(np.abs(seen["force"] / seen["scatter"])[valid] < k) for k in (1, 2)
        ]
        rows.append([*cells, f"{within[0]:.0%}, {within[1]:.0%} of {valid.sum()}"])
    header = "width over mean wavelength | contacts | approach [h_rms]: mean, sd, largest | ln F at the approach | "
    header += "ln A at the force | ln mean radius | valid: within 1, 2 sd"
    forms = "{} | {} | {:+.2f}, {:.2f}, {:.2f} | {:+.2f} ± {:.2f} | {:+.2f} ± {:.2f} | {:+.2f} ± {:.2f}"
    figure, (left, right) = panels(1, 2, (9, 4))
    forces = [f"{10.0**k} N" for k in (-1, 0, 1, 2)]
    ball = rough_contact(FACE, "5 mm", "110 GPa", force=forces, theory="calibrated")
    for r, p, force in zip(
        ball.position, ball.pressure, np.asarray(ball.force), strict=True
    ):
        left.semilogy(r, 1e3 * p, label=f"{force:.3g} N")
    left.set(
        xlabel="distance from the middle [um]",
        ylabel="mean pressure [MPa]",
        ylim=(1, None),
    )
    law = ball.law(1e-3)
    x = np.linspace(law.first, 4, 200)[1:]
    right.semilogy(x, law.force(x), label="rough")
    smooth = 4 / 3 * 110e-3 * np.sqrt(5e3) * x[x > 0] ** 1.5  # N, of um and GPa
    right.semilogy(x[x > 0], smooth, "--", label="smooth (Hertz)")
    right.set(xlabel="approach [um]", ylabel="force [N]", ylim=(1e-4, 200))
    for axes in (left, right):
        axes.legend(fontsize="small")
    return {"spheres": table(header, rows, forms)}, {
        "docs/figures/rough_bodies.svg": figure
    }


BINS = (0.0005, 0.002, 0.005, 0.01, 0.03, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 0.9, 0.98)


def summary_table(sets: Iterable[distances.DataSet]) -> str:
    """Root mean square deviations of every theory from data sets: area, force and stiffness."""
    rows = []
    for one in sets:
        cells = []
        for name, theory in distances.THEORIES.items():
            found = distances.distances(one.seen, theory)
            sums = [distances.summed_up(one.seen, values) for values in found.values()]
            text = " / ".join(percent(rms) for rms, _ in sums)
            # stiffness may be missing at a last load by itself
            short = " †" if 0 < sums[0][1] < 0.995 else ""
            cells.append(
                "—"
                if text == "— / — / —"
                else f"{text}{'*' if name in one.fitted else ''}{short}"
            )
        rows.append([f"{one.title} ({len(one.seen)})", *cells])
    return table(f"simulated surfaces (number) | {' | '.join(distances.THEORIES)}", rows)


def by_contact() -> Any:
    """Theory over simulation against contact on held-out surfaces: means, of two theories with a standard deviation."""
    figure, axes = panels(3, 1, (9, 9), sharex=True)
    seen = distances.held_out()
    area, middle = (
        np.concatenate([one.area for one in seen]),
        np.sqrt(np.multiply(BINS[1:], BINS[:-1])),
    )
    for (theory, make), hue in zip(
        distances.THEORIES.items(), distances.HUES, strict=True
    ):
        for ax, values in zip(
            axes, distances.distances(seen, make).values(), strict=True
        ):
            mean, spread, count = by_bin(area, values, BINS, np.mean, np.std, np.size).T
            x, mean, spread = (each[count > 4] for each in (middle, mean, spread))
            ax.plot(x, np.exp(mean), ".-", color=hue, label=theory)
            if theory in ("MBMA reported", "calibrated"):
                ax.fill_between(
                    x,
                    np.exp(mean - spread),
                    np.exp(mean + spread),
                    color=hue,
                    alpha=0.15,
                    lw=0,
                )
    for ax, quantity in zip(axes, QUANTITIES, strict=True):
        ax.axhline(1, color="k", lw=0.5)
        ax.set(
            xscale="log",
            xlim=(2e-4, 1.1),
            yscale="log",
            ylim=(0.1, 10),
            ylabel=f"{quantity}, theory / simulation",
        )
        ax.grid(alpha=0.3)
    axes[0].set(
        yscale="linear",
        ylim=(0.4, 1.6),
        title=f"{len(seen)} held-out self-affine surfaces",
    )
    axes[-1].set_xlabel(r"$A/A_0$ simulated")
    # below, where it hides no curve
    figure.legend(
        *axes[0].get_legend_handles_labels(),
        fontsize="small",
        loc="outside lower center",
        ncols=5,
    )
    return figure


def fidelity() -> Measured:
    parts = {"summary": summary_table(distances.data_sets().values())}
    parts["scores"] = distances.scores(
        distances.THEORIES | distances.theories_of(distances.OTHERS)
    )
    return parts, {"docs/figures/fidelity.svg": by_contact()}


def draw_data(tree: Any) -> Any:
    figure, (left, middle, right) = panels(1, 3, (11, 3.6))
    hard, elastic, leaky = (
        tree[name].to_dataset() for name in ("hardness", "elastic", "leakage")
    )
    style: dict[str, Any] = {"ms": 1.5, "alpha": 0.5, "rasterized": True}
    for row in range(hard.sizes["hardness"]):
        of = hard.isel(hardness=row)
        left.loglog(
            of.force.values.ravel(),
            of.area.values.ravel(),
            ".",
            color=str(0.8 - 0.13 * row),
            **style,
        )
    middle.semilogy(
        elastic.mean_separation.values.ravel(),
        elastic.force.values.ravel(),
        ".",
        color="C0",
        **style,
    )
    right.semilogy(
        leaky.area.values.ravel(),
        leaky.flow.max("axis").values.ravel(),
        ".",
        color="C2",
        **style,
    )
    left.set(xlabel="pressure F/(A0 E* g)", ylabel="contact area A/A0")
    middle.set(xlabel="mean gap u/h_rms", ylabel="pressure F/(A0 E* g)", xlim=(0, 5))
    right.set(
        xlabel="contact area A/A0",
        ylabel="flow coefficient/h_rms³",
        ylim=(1e-6, 100),
        xlim=(0, 0.5),
    )
    return figure


def data() -> Measured:
    tree, rows = boundary_elements(), []
    for name, group in tree.children.items():
        own = group.to_dataset()
        of = own.to_dataframe() if "contact" in own.dims else None
        count = (
            own.sizes["surface"]
            if of is None
            else of.groupby([*of.columns[: of.columns.get_loc("force")]]).ngroups
        )
        rows.append(
            [f"`{name}`", own.attrs["title"], count, int(np.isfinite(own.area).sum())]
        )
    return {"groups": table("group | content | surfaces | contacts", rows)}, {
        "docs/figures/data.svg": draw_data(tree)
    }
