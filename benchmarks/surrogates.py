"""Surrogates of contact islands compared: error, size, time to fit and to look up, behaviour outside.

``python -m benchmarks surrogates`` fits all of them to the exact islands of the shipped
four-number table, on its axes and in its logarithms of Phi over that of a rigid sphere, and
compares them at random islands that none has seen. It writes the table and the figure of
docs/tables.md. What is not installed is left out, and named.
"""

import dataclasses
import functools
import importlib.util
import math
import pathlib
import pickle
import tempfile
import time
import timeit
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import click
import numpy as np
from matplotlib.transforms import Bbox
from scipy.interpolate import NdBSpline, RegularGridInterpolator, make_interp_spline

from generate import page
from generate.files import ROOT
from mbma_tables import open_table
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.common.files import shipped_file, write_file
from mbma_tables.islands import greenwood_tripp
from mbma_tables.tables.configuration import load
from mbma_tables.tables.island4d import Island4dModel, band_fields
from mbma_tables.tables.make_island4d import Island4d, from_axes
from mbma_tables.tables.make_universal import Universal
from mbma_tables.tables.universal import UniversalModel
from mbma_tables.tables.writer import write_table
from mbma_tables.theories.mbma.closed_forms import ISLAND_FORMS, FormulaModel

HELD_OUT = 4000
MILLION = 1_000_000
SECONDS = 1.0  # of processor time for many lookups, after which fewer than a million are counted
SEED = 20261
WORKERS = 2
SMALLER = {"universal": (1e-4, 1e-7), "island4d": (2e-3, 2e-4)}  # targets
# islands that dense methods are fitted to
PROCESS_POINTS = 1500
KRIGING_POINTS = 300
RIDGE_POINTS = 20_000
OWN = "mbma_tables"
FIGURE = "docs/figures/surrogates.svg"
MARKER = 6.0  # size of a marker of the figure, points
POINTS_PER_INCH = 72
# of labels from their markers, points: the nearest that is free is taken
OFFSETS = sorted(
    ((side * right, up) for side in (1, -1) for right in (5, 9) for up in range(-30, 31)),
    key=lambda offset: (abs(offset[1] + 2) + 4 * abs(offset[0]), offset[0] < 0),
)


@dataclasses.dataclass
class Islands:
    """Points in units of nodes on the axes of the table, (n, 4), and what islands are there."""

    points: FloatArray
    X: FloatArray
    spread: FloatArray
    sphere: FloatArray
    hurst: FloatArray

    @functools.cached_property
    def mu(self) -> FloatArray:
        """Stiffness of the roughness."""
        table = open_table("island4d")
        return band_fields(self.spread, self.sphere, self.hurst, table.variant)[0]

    @functools.cached_property
    def numbers(self) -> tuple[FloatArray, ...]:
        """delta/h_rms, zeta_d, zeta_u and H."""
        variant = open_table("island4d").variant
        zeta_d = np.minimum(from_axes(self.sphere, self.hurst), 1e6)
        sigma = band_fields(self.spread, self.sphere, self.hurst, variant)[1]
        delta = (self.X * sigma + 1) * zeta_d**-self.hurst
        return delta, zeta_d, zeta_d * (1 + self.spread), self.hurst

    @functools.cached_property
    def rigid(self) -> FloatArray:
        """Phi_F and Phi_A of a rigid sphere, (2, n)."""
        return greenwood_tripp.rigid_sphere(self.X, self.mu)

    @functools.cached_property
    def exact(self) -> FloatArray:
        """Phi_F and Phi_A, (2, n)."""
        solved = greenwood_tripp.solve(self.X, self.mu, rtol=1e-10)
        return np.stack([solved.phi_F, solved.phi_A])


def islands_at(points: FloatArray) -> Islands:
    """Islands at points in units of nodes."""
    axes = open_table("island4d").content.axes
    places = [a.coordinate(p) for a, p in zip(axes, points.T, strict=True)]
    return Islands(points, *places)


def random_islands(count: int, seed: int) -> Islands:
    """Islands evenly over the box of the axes."""
    nodes = np.array([axis.nodes - 1 for axis in open_table("island4d").content.axes])
    return islands_at(np.random.default_rng(seed).uniform(size=(count, 4)) * nodes)


@dataclasses.dataclass
class Surrogate:
    """A way to Phi_F and Phi_A; `answer` gives both, (2, n), or their logarithms over the rigid sphere's."""

    name: str
    package: str
    points: int  # islands that it was made of
    fitted_in: float  # s
    size: int  # bytes
    answer: Callable[[Islands], Any]  # for errors
    many: Callable[[Islands], Any]  # for times
    in_logarithms: bool = True
    one: Callable[[Islands], Any] | None = (
        None  # for one island, and outside, if not `many`
    )


# ---- other packages ----


def nodes() -> tuple[list[FloatArray], FloatArray]:
    """Nodes along the axes in their units, and the logarithms there, (..., 2)."""
    content = open_table("island4d").content
    lines = [np.arange(axis.nodes, dtype=float) for axis in content.axes]
    values = [content.auxiliary[f"log_ratio_{f}"][1] for f in "FA"]
    return lines, np.stack(values, axis=-1)


def of_points(
    name: str,
    package: str,
    points: int,
    fit: Callable[[], tuple[Callable[[FloatArray], Any], Any]],
) -> Surrogate:
    """A surrogate by a fit, which returns a function of points and what is kept."""
    start = time.perf_counter()
    with warnings.catch_warnings():
        # of iterations that end where they are told to
        warnings.simplefilter("ignore")
        predict, kept = fit()
    spent = time.perf_counter() - start
    size = kept if isinstance(kept, int) else len(pickle.dumps(kept))

    def answer(islands: Islands) -> Any:
        return predict(islands.points)

    return Surrogate(name, package, points, spent, size, answer, answer)


def spline(degree: int) -> tuple[Callable[[FloatArray], Any], int]:
    """A tensor spline of scipy."""
    lines, values = nodes()
    knots = []
    for axis, line in enumerate(lines):
        moved = np.moveaxis(values, axis, 0)
        one = make_interp_spline(line, moved, degree)
        knots.append(one.t)
        values = np.moveaxis(one.c, 0, axis)
    made = NdBSpline(
        tuple(knots), np.ascontiguousarray(values), degree, extrapolate=False
    )
    return made, values.nbytes


def grid_interpolator(method: str) -> tuple[Callable[[FloatArray], Any], int]:
    """Local interpolation of scipy."""
    lines, values = nodes()
    made = RegularGridInterpolator(lines, values, method)
    return made, values.nbytes


def by_interpn(kind: str) -> tuple[Callable[[FloatArray], Any], int]:
    """Both functions by a class of interpn."""
    import interpn

    lines, values = nodes()
    shape = [line.size for line in lines]
    made = [
        getattr(interpn, kind).new(
            shape, np.zeros(4), np.ones(4), np.ascontiguousarray(values[..., f])
        )
        for f in range(2)
    ]

    def predict(points: FloatArray) -> FloatArray:
        columns = [np.ascontiguousarray(column) for column in points.T]
        return np.stack([one.eval(columns) for one in made], axis=-1)

    return predict, values.nbytes


def table_points(count: int | None = None) -> tuple[FloatArray, FloatArray]:
    """Nodes in [0, 1], all or some of them drawn at random, and the logarithms there."""
    lines, values = nodes()
    mesh = np.meshgrid(*(line / line[-1] for line in lines), indexing="ij")
    points = np.stack([column.ravel() for column in mesh], axis=-1)
    logarithms = values.reshape(-1, 2)
    if count is None:
        return points, logarithms
    some = np.random.default_rng(SEED).choice(len(points), count, replace=False)
    return points[some], logarithms[some]


def learned(estimator: Any, count: int | None = None) -> Callable[[], tuple[Any, Any]]:
    """A fit of a scikit-learn estimator of both logarithms."""

    def fit() -> tuple[Callable[[FloatArray], Any], Any]:
        estimator.fit(*table_points(count))
        last = np.array([line[-1] for line in nodes()[0]])
        return lambda points: estimator.predict(points / last), estimator

    return fit


def kriging() -> tuple[Callable[[FloatArray], Any], Any]:
    """Kriging of SMT; of its size only points and correlation lengths are counted."""
    from smt.surrogate_models import KRG

    points, logarithms = table_points(KRIGING_POINTS)
    last = np.array([line[-1] for line in nodes()[0]])
    made = []
    for f in range(2):
        one = KRG(print_global=False)
        one.set_training_values(points, logarithms[:, f : f + 1])
        one.train()
        made.append(one)

    def predict(places: FloatArray) -> FloatArray:
        return np.hstack([one.predict_values(places / last) for one in made])

    return predict, len(pickle.dumps([one.optimal_theta for one in made])) + points.nbytes


def peers() -> Iterator[Surrogate]:
    """Those of other packages, as far as they are installed."""
    count = math.prod(line.size for line in nodes()[0])
    scipy = functools.partial(of_points, package="scipy", points=count)
    yield scipy("NdBSpline, quintic", fit=lambda: spline(5))
    yield scipy("NdBSpline, cubic", fit=lambda: spline(3))
    for method in ("cubic", "linear"):
        yield scipy(
            f"RegularGridInterpolator, {method}",
            fit=functools.partial(grid_interpolator, method),
        )
    if importlib.util.find_spec("interpn"):
        for name, kind in (
            ("cubic", "MulticubicRegular"),
            ("linear", "MultilinearRegular"),
        ):
            fit = functools.partial(by_interpn, kind)
            yield of_points(f"interpn, {name}", "interpn", count, fit)
    if importlib.util.find_spec("smt"):
        yield of_points("SMT, Kriging", "smt", KRIGING_POINTS, kriging)
    yield from learners(count)


def learners(count: int) -> Iterator[Surrogate]:
    """Those of scikit-learn."""
    from sklearn.ensemble import HistGradientBoostingRegressor
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import Matern
    from sklearn.linear_model import Ridge
    from sklearn.multioutput import MultiOutputRegressor
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    ridge = make_pipeline(PolynomialFeatures(8), StandardScaler(), Ridge(1e-6))
    process = GaussianProcessRegressor(Matern([1.0] * 4, nu=2.5), normalize_y=True)
    network = make_pipeline(
        StandardScaler(), MLPRegressor(hidden_layer_sizes=(64, 64), max_iter=15)
    )
    trees = MultiOutputRegressor(HistGradientBoostingRegressor(max_iter=300))
    for name, estimator, points in (
        ("ridge, polynomials of degree 8", ridge, RIDGE_POINTS),
        ("Gaussian process", process, PROCESS_POINTS),
        ("multilayer perceptron, 64 x 64", network, None),
        ("gradient boosting, 300 trees", trees, None),
    ):
        yield of_points(name, "scikit-learn", points or count, learned(estimator, points))


# ---- this library ----


def of_table(kind: str, target: float | None) -> Surrogate:
    """A table of this library: made again, to a target or as it is shipped."""
    maker = {"universal": Universal, "island4d": Island4d}[kind]
    start = time.perf_counter()
    content = maker(load(kind, target=target), WORKERS).build()
    spent = time.perf_counter() - start
    if target is None:
        size = shipped_file(f"{kind}.nc").stat().st_size
    else:
        with tempfile.TemporaryDirectory() as folder:
            size = write_table(pathlib.Path(folder, "own.nc"), content).stat().st_size
    name = f"{kind}, {'shipped' if target is None else f'target {target:g}'}"
    cells_or_nodes = (
        content.coefficients[..., 0].size
        if kind == "universal"
        else math.prod(axis.nodes for axis in content.axes)
    )
    if kind == "universal":
        table = UniversalModel(content)

        def answer(islands: Islands) -> Any:
            return table.answer(islands.X, islands.mu)[:2]

        return Surrogate(name, OWN, cells_or_nodes, spent, size, answer, answer, False)
    four = Island4dModel(content)

    def of_four(islands: Islands) -> Any:
        fields = {"X": islands.X, "width": np.log1p(islands.spread), "mu": islands.mu}
        fields |= {
            "hurst": islands.hurst,
            "zeta_d": from_axes(islands.sphere, islands.hurst),
        }
        return four.of_islands(fields)[:2]

    def looked_up(islands: Islands) -> Any:
        return four.lookup(*islands.numbers)

    return Surrogate(name, OWN, cells_or_nodes, spent, size, of_four, looked_up, False)


def of_form(form: str) -> Surrogate:
    """A closed form; its coefficients were chosen by `python -m generate formulas`."""
    from mbma_tables.theories.mbma.closed_form_certificates import CERTIFICATES

    coefficients = sum(one.coefficients for one in CERTIFICATES[form].values())
    model = FormulaModel(form)

    def answer(islands: Islands) -> Any:
        return model.answer(islands.X, islands.mu, outside="nan")[:2]

    def one(islands: Islands) -> Any:
        return model.answer(islands.X, islands.mu)

    name = f"closed form, {form}"
    return Surrogate(
        name, OWN, 3000, math.nan, 8 * coefficients, answer, answer, False, one
    )


def own() -> Iterator[Surrogate]:
    """Tables in three sizes, and the closed forms."""
    for kind, targets in SMALLER.items():
        yield of_table(kind, None)
        for target in reversed(targets):
            yield of_table(kind, target)
    for form in reversed(ISLAND_FORMS):
        yield of_form(form)


# ---- measured ----


def errors(surrogate: Surrogate, held_out: Islands) -> FloatArray:
    """The larger of both functions' relative errors; NaN where there is no answer."""
    found = np.asarray(surrogate.answer(held_out))
    if surrogate.in_logarithms:
        found = held_out.rigid * np.exp(found.reshape(-1, 2).T)
    return np.max(np.abs(found / held_out.exact - 1), axis=0)


def one_island(is_own: bool) -> Islands:
    """An island in the midst of all ranges; for this library its numbers are floats."""
    last = [axis.nodes - 1 for axis in open_table("island4d").content.axes]
    one = islands_at(0.45 * np.array([last]))
    if not is_own:
        return one
    single = dataclasses.replace(one, X=float(one.X[0]))  # type: ignore[arg-type]
    single.__dict__ |= {
        "mu": float(one.mu[0]),
        "numbers": tuple(float(number[0]) for number in one.numbers),
    }
    return single


def time_of_one(surrogate: Surrogate) -> float:
    """Least time of one lookup, s."""
    one = one_island(surrogate.package == OWN)
    ask = surrogate.one or surrogate.many
    ask(one)
    timer = timeit.Timer(lambda: ask(one))
    number, spent = timer.autorange()
    return min(spent, *timer.repeat(4, number)) / number


def time_of_many(surrogate: Surrogate) -> float:
    """Time of a lookup among a million, or as many as `SECONDS` suffice for, s a point."""
    count = 1000
    while True:
        islands = random_islands(count, SEED + 3)
        _ = islands.mu, islands.numbers
        start = time.perf_counter()
        surrogate.many(islands)
        spent = time.perf_counter() - start
        if spent > SECONDS / 5 or count >= MILLION:
            return spent / count
        count = min(MILLION, 5 * count)


def outside(surrogate: Surrogate) -> str:
    """What it does at an island below the first X."""
    one = one_island(False)
    axes = open_table("island4d").content.axes
    # below the first X of `universal`, too
    points = one.points - [[axes[0].nodes, 0, 0, 0]]
    beyond = dataclasses.replace(one, points=points, X=np.array([-7.0]))
    ask = surrogate.one or surrogate.many
    try:
        found = np.asarray(ask(beyond))
    except (ValueError, MbmaError):
        return "raises an error"
    return "answers" if np.isfinite(found).all() else "NaN"


def bounds() -> str:
    """How the bounds of a million lookups in the four-number table compare with their errors."""
    islands = random_islands(MILLION, SEED + 5)
    fields = {"X": islands.X, "width": np.log1p(islands.spread), "mu": islands.mu}
    fields |= {"hurst": islands.hurst, "zeta_d": from_axes(islands.sphere, islands.hurst)}
    found = open_table("island4d").of_islands(fields)
    exact = open_table("universal").answer(islands.X, islands.mu)
    pairs = zip(found[:2], exact[:2], strict=True)
    error = np.max([np.abs(one / other - 1) for one, other in pairs], axis=0)
    row = [
        f"{error.size:,}",
        f"{error.max():.2g}",
        f"{np.median(error):.2g}",
        f"{np.median(found.error / error):.2g}",
        f"{int((error > found.error + exact.error).sum())}",
    ]
    header = "islands | largest error | median error | median bound over error | errors above their bound"
    return page.table(header, [row])


def row_of(surrogate: Surrogate, held_out: Islands) -> dict[str, Any]:
    """All that is measured of a surrogate."""
    error = errors(surrogate, held_out)
    answered = np.isfinite(error)
    return {
        "name": surrogate.name,
        "package": surrogate.package,
        "points": surrogate.points,
        "fitted_in": surrogate.fitted_in,
        "largest": float(error[answered].max()),
        "median": float(np.median(error[answered])),
        "answered": float(answered.mean()),
        "size": surrogate.size,
        "one": time_of_one(surrogate),
        "many": time_of_many(surrogate),
        "outside": outside(surrogate),
    }


def text_of(rows: list[dict[str, Any]]) -> str:
    """The table of the page."""
    header = (
        "surrogate | package | islands | time to fit | largest error | median | islands covered | bytes | "
        "one lookup | a million | outside"
    )
    cells = []
    for row in rows:
        fitted = "—" if math.isnan(row["fitted_in"]) else page.duration(row["fitted_in"])
        cells.append(
            [
                row["name"],
                row["package"],
                f"{row['points']:,}",
                fitted,
                f"{row['largest']:.1e}",
                f"{row['median']:.1e}",
                f"{page.percent(row['answered'])}%",
                f"{row['size']:,}",
                page.duration(row["one"]),
                page.duration(MILLION * row["many"]),
                row["outside"],
            ]
        )
    return page.table(header, cells)


def drawn(rows: list[dict[str, Any]]) -> Any:
    """Largest error against the time of a million lookups."""
    figure, axis = page.panels(size=(8, 5))
    for row in rows:
        mine = row["package"] == OWN
        time_of_all = MILLION * row["many"]
        axis.loglog(
            time_of_all,
            row["largest"],
            "o" if mine else "s",
            color="C3" if mine else "C0",
        )
    axis.set_xlabel("time of a million lookups [s]")
    axis.set_ylabel("largest relative error on held-out islands")
    axis.margins(x=0.25, y=0.1)
    places = [(MILLION * row["many"], row["largest"]) for row in rows]
    label(figure, axis, [row["name"] for row in rows], places)
    return figure


def label(
    figure: Any, axis: Any, names: list[str], places: list[tuple[float, float]]
) -> None:
    """Write names beside markers, each where it covers no other name and no marker."""
    figure.draw_without_rendering()
    centres = axis.transData.transform(places)
    marker = MARKER * figure.dpi / POINTS_PER_INCH
    taken = [Bbox.from_bounds(*(c - marker / 2), marker, marker) for c in centres]
    for name, place in zip(names, places, strict=True):
        text = axis.annotate(name, place, (0, 0), textcoords="offset points", fontsize=7)
        text.set_in_layout(False)  # so that markers stay where they are
        for offset in OFFSETS:
            text.set_position(offset)
            text.set_horizontalalignment("left" if offset[0] > 0 else "right")
            box = text.get_window_extent()
            is_inside = Bbox.union([box, axis.bbox]).bounds == axis.bbox.bounds
            if is_inside and not box.count_overlaps(taken):
                break
        else:
            raise click.ClickException(f"the figure has no place for {name!r}")
        taken.append(box)


def measured_before() -> list[dict[str, Any]]:
    """What the figure shows, from the table of the page."""
    text = (ROOT / "docs/tables.md").read_text(encoding="utf-8")
    blocks = {match[2]: match[0] for match in page.MARKED.finditer(text)}
    lines = [line for line in blocks["surrogates"].splitlines() if line.startswith("|")]
    header, _, *cells = (line.strip("| ").split(" | ") for line in lines)
    rows = [dict(zip(header, row, strict=True)) for row in cells]
    return [
        {
            "name": row["surrogate"],
            "package": row["package"],
            "largest": float(row["largest error"]),
            "many": page.seconds(row["a million"]) / MILLION,
        }
        for row in rows
    ]


@click.command()
@click.option(
    "--redraw", is_flag=True, help="Only draw the figure anew, from the page's table."
)
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path),
    default=ROOT,
    help="Folder below which docs/tables.md and its figure are written.",
)
def surrogates(redraw: bool, out: pathlib.Path) -> None:
    """Measure surrogates of contact islands, and write docs/tables.md (ten minutes)."""
    if redraw:
        write_file(out / FIGURE, page.svg(drawn(measured_before())), make_folders=True)
        click.echo(out / FIGURE)
        return
    start = time.perf_counter()
    held_out = random_islands(HELD_OUT, SEED + 1)
    rows = []
    for source in (own, peers):
        for surrogate in source():
            rows.append(row_of(surrogate, held_out))
            click.echo(
                f"{time.perf_counter() - start:4.0f} s  {surrogate.name}: {rows[-1]['largest']:.1e}"
            )
    missing = [name for name in ("interpn", "smt") if not importlib.util.find_spec(name)]
    note = f"Not installed, and left out: {', '.join(missing)}.\n\n" if missing else ""
    parts = {"surrogates": note + text_of(rows), "bounds": bounds()}
    figures = {FIGURE: drawn(rows)}
    for path in page.write("docs/tables.md", parts, figures, out):
        click.echo(path)
    click.echo(f"{time.perf_counter() - start:.0f} s")
