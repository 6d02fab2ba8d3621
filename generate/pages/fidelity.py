"""docs/fidelity.md: theories beside simulations."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from generate import distances
from generate.calibrated_file import QUANTITIES, by_bin
from generate.page import Measured, panels, percent, table
from generate.pages.score import OTHERS, scores, theories_of
from mbma_tables.data import boundary_elements

BANDED = ("MBMA reported", "calibrated")
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
            cells.append("—" if text == "— / — / —" else f"{text}{'*' if name in one.fitted else ''}{short}")
        rows.append([f"{one.title} ({len(one.seen)})", *cells])
    return table(f"simulated surfaces (number) | {' | '.join(distances.THEORIES)}", rows)


def by_contact(sets: dict[str, distances.DataSet], keys: list[str], height: float) -> Any:
    """Theory over simulation against contact, of each surface of data sets, or mean and standard deviation of many."""
    figure, axes = panels(3, len(keys), (9, height), sharex=True, sharey="row", squeeze=False)
    for column, key in zip(axes.T, keys, strict=True):
        seen = sets[key].seen
        for theory, make in distances.THEORIES.items():
            style: dict[str, Any] = {"color": distances.HUES[theory], "label": theory}
            if len(seen) > 2:
                area = np.concatenate([one.area for one in seen])
                for ax, values in zip(column, distances.distances(seen, make).values(), strict=True):
                    known = by_bin(area, values, BINS, np.mean, np.std, np.size)
                    kept = known[:, 2] > 4
                    x, (mean, spread, _) = np.sqrt(np.multiply(BINS[1:], BINS[:-1]))[kept], known[kept].T
                    ax.plot(x, np.exp(mean), ".-", **style)
                    if theory in BANDED:
                        band = np.exp(mean - spread), np.exp(mean + spread)
                        ax.fill_between(x, *band, color=distances.HUES[theory], alpha=0.15, lw=0)
                continue
            for k, one in enumerate(seen):
                for ax, values in zip(column, distances.distances([one], make).values(), strict=True):
                    ax.plot(one.area, np.exp(values), ".-", **style | {"label": "_" if k else theory, "lw": 1, "ms": 4})
        column[0].set_title(sets[key].title, fontsize="small")
        column[-1].set_xlabel(r"$A/A_0$ simulated")
    for line, quantity in zip(axes, QUANTITIES, strict=True):
        for ax in line:
            ax.axhline(1, color="k", lw=0.5)
            ax.set(xscale="log", xlim=(2e-4, 1.1), yscale="linear" if quantity == "area" else "log")
            ax.set_ylim((0.4, 1.6) if quantity == "area" else (0.1, 10))
            ax.grid(alpha=0.3)
            if len(keys) > 1:
                ax.minorticks_off()
        line[0].set_ylabel(f"{quantity}, theory / simulation")
    # below, where it hides no curve
    figure.legend(*axes[0, 0].get_legend_handles_labels(), fontsize="small", loc="outside lower center", ncols=5)
    return figure


def drawn() -> dict[str, Any]:
    """Figures of deviations by name."""
    sets, seen = distances.data_sets(), distances.held_out()
    sets["held out"] = distances.DataSet(f"{len(seen)} held-out self-affine surfaces", seen)
    columns = {"fidelity": ["held out"], "reference": ["bem", "gfmd", "challenge", "rolloff"]}
    columns["maps"] = list(distances.MEASURED)
    return {name: by_contact(sets, keys, 9 if name == "fidelity" else 7.5) for name, keys in columns.items()}


def draw_data(tree: Any) -> Any:
    """Area against pressure, pressure against gap and flow against area, of every surface."""
    figure, (left, middle, right) = panels(1, 3, (11, 3.6))
    hard, elastic, leaky = (tree[name].to_dataset() for name in ("hardness", "elastic", "leakage"))
    style: dict[str, Any] = {"ms": 1.5, "alpha": 0.5, "rasterized": True}
    for row in range(hard.sizes["hardness"]):
        of = hard.isel(hardness=row)
        left.loglog(of.force.values.ravel(), of.area.values.ravel(), ".", color=str(0.8 - 0.13 * row), **style)
    middle.semilogy(elastic.mean_separation.values.ravel(), elastic.force.values.ravel(), ".", color="C0", **style)
    right.semilogy(leaky.area.values.ravel(), leaky.flow.max("axis").values.ravel(), ".", color="C2", **style)
    left.set(xlabel="pressure F/(A0 E* g)", ylabel="contact area A/A0")
    middle.set(xlabel="mean gap u/h_rms", ylabel="pressure F/(A0 E* g)", xlim=(0, 5))
    right.set(xlabel="contact area A/A0", ylabel="flow coefficient/h_rms³", ylim=(1e-6, 100), xlim=(0, 0.5))
    return figure


def data() -> Measured:
    """Groups of the data set, and a figure."""
    tree, rows = boundary_elements(), []
    for name, group in tree.children.items():
        own = group.to_dataset()
        of = own.to_dataframe() if "contact" in own.dims else None
        count = own.sizes["surface"] if of is None else of.groupby([*of.columns[: of.columns.get_loc("force")]]).ngroups
        rows.append([f"`{name}`", own.attrs["title"], count, int(np.isfinite(own.area).sum())])
    return {"groups": table("group | content | surfaces | contacts", rows)}, {"docs/figures/data.svg": draw_data(tree)}


def measure() -> Measured:
    """The measured blocks of the page, and its figures."""
    parts = {"summary": summary_table(distances.data_sets().values())}
    parts["scores"] = scores(distances.THEORIES | theories_of(OTHERS))
    return parts, {f"docs/figures/{name}.svg": figure for name, figure in drawn().items()}
