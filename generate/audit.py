"""``python -m generate audit``: search for wrong bounds, for untested answers that are `valid`, and for bad failures.

README and docs/guarantees.md quote the counts.
"""

import functools
import itertools
import reprlib
import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import click
import hypothesis
import numpy as np
import xarray as xr
from hypothesis import strategies as st

from generate.audit_routes import Misses, Question, Reference, refusals, routes_here
from generate.boundary_elements.evidence import evidence
from generate.files import ROOT
from generate.page import table
from generate.page import write as write_page
from generate.pages.simulations import WIDE
from mbma_tables import (
    Bodies,
    Joint,
    MbmaError,
    Surface,
    contact,
    contact_law,
    flow_factors,
    island,
    sensitivity,
)
from mbma_tables.theories import THEORIES, Mbma
from mbma_tables.theories.calibrated.formulas import self_affine_law

LONGEST = 10.0  # seconds of one request
RANGES = (
    (0.05, 1.0),
    (np.log(3.1), np.log(1e5)),
    (1.0, 32.0),
    (-7.0, -0.5),
    (3.0, 9.0),
)  # of searches
GAPS = 20  # of one surface
ROUNDED = 4 * np.finfo(float).eps  # of a mean separation
FORMATS = "{} | {:,} | {:,} | {} | {:.2g}"
ROUTE_QUESTIONS = 150
SMALLEST = 1e-290  # beyond, values lose digits to underflow


class Found(NamedTuple):
    """What one check found: numbers of its answers, its worst answer, and the input that gives it."""

    what: str
    answers: int
    refused: int
    beyond: int
    worst: float
    where: str


def surface_of(hurst: float, log_zeta: float, height: float) -> Surface:
    return Surface(hurst, 1.0, float(np.exp(log_zeta)), 1.0, height)


def miss(found: Any, reference: Any, allowed: Any) -> np.ndarray:
    """Distances of pressures and areas from their references, over what is allowed."""
    ratios = []
    for value, other in zip(found, reference, strict=True):
        seen = np.abs(other) > SMALLEST
        ratios.append(
            np.abs(value[seen] / other[seen] - 1)
            / np.broadcast_to(allowed, seen.shape)[seen]
        )
    return np.concatenate(ratios)


def mbma(surface: Surface, u: np.ndarray, rtol: float) -> np.ndarray:
    """MBMA by its table against every island solved."""
    found = contact(surface, mean_separation=u, theory=Mbma(rtol=rtol))
    exact = contact(
        surface, mean_separation=u, theory=Mbma(island_model="exact", rtol=1e-10)
    )
    return miss(
        (found.pressure, found.area),
        (exact.pressure, exact.area),
        found.error + exact.error,
    )


def calibrated(surface: Surface, u: np.ndarray, rtol: float) -> np.ndarray:
    """The calibrated law's table against its own quadrature."""
    found = contact(surface, mean_separation=u, theory="calibrated")
    pressure, area, _ = self_affine_law(
        surface.hurst, surface.zeta_1, surface.h_max
    ).contact(u)
    return miss(
        (found.pressure, found.area), (pressure * surface.rms_gradient, area), found.error
    )


def law(
    surface: Surface, u: np.ndarray, rtol: float, theory: str, hardness: float = np.inf
) -> np.ndarray:
    """A law against the theory that it was made of."""
    made = contact_law(
        surface, Bodies(hardness=hardness), theory=theory, rtol=max(rtol, 1e-8)
    )
    gaps = u[
        (u > (made.lowest + surface.h_max) / 2)
        & (surface.h_max - u > 1e-6 * surface.h_max)
    ]
    found = contact(
        surface, Bodies(hardness=hardness), mean_separation=gaps, theory=theory
    )
    return miss(
        (made.pressure(gaps), made.area(gaps)),
        (found.pressure, found.area),
        made.error + found.error,
    )


def inverse(
    surface: Surface, u: np.ndarray, rtol: float, theory: str, hardness: float = np.inf
) -> np.ndarray:
    """A pressure through the separation at which it acts; what rounding of that separation changes is allowed."""
    bodies = Bodies(hardness=hardness)
    at_gaps = contact(surface, bodies, mean_separation=u, theory=theory)
    asked = np.asarray(at_gaps.pressure)
    asked = asked[(asked > SMALLEST) & np.isfinite(asked)]
    back = contact(surface, bodies, pressure=asked, theory=theory)
    u_back = back.mean_separation
    again = contact(surface, bodies, mean_separation=u_back, theory=theory)
    rounding = ROUNDED * (1 + back.mean_separation * np.abs(again.stiffness) / asked)
    return miss((again.pressure,), (asked,), back.error + again.error + rounding)


HARD = {"theory": "calibrated", "hardness": 0.02}
# ratios to what is allowed, numbers of examples, and options
BOUNDS: dict[str, tuple[Callable[..., np.ndarray], int, dict[str, Any]]] = {
    "`error` of MBMA, against exact islands": (mbma, 900, {}),
    "`error` of the calibrated law, against its quadrature": (calibrated, 2400, {}),
    "`error` of laws of MBMA": (law, 600, {"theory": "mbma"}),
    "`error` of laws of the calibrated theory": (law, 600, {"theory": "calibrated"}),
    "`error` of calibrated laws with a hardness": (law, 360, HARD),
    "`error` of laws of Persson's theory": (law, 360, {"theory": "persson"}),
    "inverses of MBMA": (inverse, 900, {"theory": "mbma"}),
    "inverses of the calibrated theory": (inverse, 1800, {"theory": "calibrated"}),
    "inverses of the calibrated theory with a hardness": (inverse, 600, HARD),
    "inverses of Persson's theory": (inverse, 360, {"theory": "persson"}),
}


def bound(what: str, seed: int, scale: float) -> list[Found]:
    """Search for surfaces, gaps and tolerances at which an answer is farthest from its reference."""
    ratio, examples, options = BOUNDS[what]
    count = refused = beyond = 0
    worst = 0.0
    where = ""
    phases = [hypothesis.Phase.generate, hypothesis.Phase.target]
    unchecked = list(hypothesis.HealthCheck)
    options_of_search: dict[str, Any] = {
        "phases": phases,
        "suppress_health_check": unchecked,
        "database": None,
    }

    @hypothesis.seed(seed)
    @hypothesis.settings(
        max_examples=max(int(scale * examples), 1), deadline=None, **options_of_search
    )
    # hurst, log_zeta, height, nearest and digits
    @hypothesis.given(*itertools.starmap(st.floats, RANGES))
    def search(
        hurst: float, log_zeta: float, height: float, nearest: float, digits: float
    ) -> None:
        nonlocal count, refused, beyond, worst, where
        surface = surface_of(hurst, log_zeta, height)
        u = surface.h_max * (1 - np.geomspace(10**nearest, 0.999, GAPS))
        try:
            ratios = np.atleast_1d(ratio(surface, u, 10**-digits, **options))
        except MbmaError:
            refused += 1
            return
        if not ratios.size:
            return
        largest = float(np.max(np.where(np.isnan(ratios), np.inf, ratios)))
        count += ratios.size
        beyond += int((~(ratios <= 1)).sum())
        if largest > worst:
            worst = largest
            where = f"{surface!r}, nearest={nearest:.4g}, digits={digits:.3g}"
        hypothesis.target(min(np.log(max(largest, 1e-12)), 50.0))

    search()
    return [Found(what, count, refused, beyond, worst, where)]


def validity(seed: int, scale: float) -> list[Found]:
    """Answers that are `valid` outside the ranges of the simulated surfaces in docs/data, or without a scatter."""
    rng = np.random.default_rng(seed)
    tested_ones = [one for one in evidence() if one.kind == "self_affine"]
    areas = np.concatenate([one.area for one in tested_ones])
    with xr.open_dataset(WIDE, group="bandwidth") as wide:
        ratios, surfaces = np.unique(wide["zeta_1"].values, return_counts=True)
    widest = float(ratios[surfaces > 1].max())  # of the calibrated law alone
    ends = {
        "hurst": [float(one.node[1]) for one in tested_ones],
        "zeta_1": [one.zeta_1 for one in tested_ones],
    }
    count = 0
    beyond = 0
    where = ""
    for _ in range(int(1000 * scale)):
        hurst = rng.uniform(0.02, 1.0)
        log_zeta = rng.uniform(np.log(3.1), np.log(1e4))
        # so flat that no rms gradient is above one, which no theory is valid for
        surface = Surface(
            hurst, 1e-6, float(1e-6 * np.exp(log_zeta)), 1.0, rng.uniform(1.0, 20.0)
        )
        theory = THEORIES[rng.integers(len(THEORIES))]
        u = surface.h_max * (1 - np.geomspace(1e-6, 0.99, GAPS))
        try:
            found: Any = contact(surface, mean_separation=u, theory=theory)
        except MbmaError:
            continue
        tested = (found.area >= areas[areas > 0].min()) & (found.area <= areas.max())
        for name, seen in ends.items():
            most = max(seen)
            if (theory, name) == ("calibrated", "zeta_1"):
                most = max(most, widest)
            tested &= (
                min(seen) * (1 - 1e-9) <= getattr(surface, name) <= most * (1 + 1e-9)
            )
        spread = np.isfinite(found.area_scatter) & np.isfinite(found.scatter)
        wrong = np.asarray(found.valid) & (found.pressure > 0) & ~(tested & spread)
        count = count + wrong.size
        beyond = beyond + int(wrong.sum())
        where = where or (
            f"{theory}: {surface!r}, A/A0 = {found.area[wrong][0]:.3g}"
            if wrong.any()
            else ""
        )
    return [
        Found(
            "`valid` outside the simulated ranges", count, 0, beyond, float(beyond), where
        )
    ]


NATURAL: list[Any] = [
    0.3,
    1.0,
    2,
    [0.5, 1.0],
    np.array([[0.2], [0.9]]),
    "1 um",
    "0.5 mm",
    "10 MPa",
    ["1 um", "2 um"],
]
NUMBERS: list[Any] = [
    0, -1.0, 1e-300, 5e-324, 1e300, 10**400, np.nan, np.inf, -np.inf, True, None, "", "1e400 MPa", "-3 um", "5 parsec",
    "concrete", b"1", [], ["1 um", 2.0], ["1 um", "2 mm"], {}, object(), range(3), lambda: 1, "9" * 5000, 1 + 1j,
    np.array([]), np.array([0.3, np.nan]), np.array(["a"]), np.ones((2, 3)),
    np.ma.masked_array([1.0, 2.0], [False, True]), np.array([1 + 1j]), np.datetime64("2020-01-01"),
    Surface(0.8, 1.0, 100.0, 1.0, 3.0),
]  # fmt: skip
SURFACES: list[Any] = [
    Surface(0.8, 1.0, 100.0, 1.0, 3.0), Surface(0.5, 0.01, 2.0, 1.0, 3.5, unit="um"), Surface.named("concrete"),
    Surface([0.2, 0.8], 1.0, 50.0, 1.0, [3.0, 4.0]), "concrete", None, 3.0, [1, 2],
]  # fmt: skip
METALS = [
    "steel 4140 hard",
    ("steel 4140 hard", "aluminium 6061 hard"),
    "unobtainium",
    ("steel 4140 hard",),
    3,
    None,
]
KNOWN = ("separation", "mean_separation", "pressure", "area")
OPTIONS: dict[str, list[Any]] = {
    "theory": ["mbma", "calibrated", "persson", "greenwood_williamson", "none", 3, None],
    "hardness": [*NUMBERS, "200 HV", "58 HRC", "2 GPa", 0.02],
    "materials": METALS,
    "E_star": [1.0, "100 GPa", "2 MPa", *NUMBERS],
    "rtol": [1e-6, 1e-3, *NUMBERS],
    "island_model": ["universal", "formula", "rigid", "exact", "none", 1],
    "variant": ["reported", "printed", "fitted", "none"],
    "outside": ["raise", "exact", "nan", "clamp"],
}
METHODS = (
    "pressure",
    "area",
    "stiffness",
    "energy",
    "at_pressure",
    "pressure_and_stiffness",
    "slope_error",
)


def configured(options: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Arguments of `Bodies`, and the theory with its options and whatever else is given."""
    numbers = {name: options.pop(name) for name in OF_BODIES if name in options}
    if "materials" in options:
        numbers["metals"] = options.pop("materials")
    of_mbma = {name: options.pop(name) for name in OF_MBMA if name in options}
    if of_mbma:
        options["theory"] = Mbma(**of_mbma)
    return numbers, options


def contact_call(surface: Any, **options: Any) -> Any:
    """`contact` with constants of the bodies and options of MBMA by name."""
    numbers, others = configured(options)
    return contact(surface, Bodies(**numbers), **others)


def law_call(method: str, value: Any, surface: Any, theory: Any, **options: Any) -> Any:
    """A method of a law."""
    rtol = options.pop("rtol", 1e-8)
    numbers, _ = configured(options)
    law_made = contact_law(surface, Bodies(**numbers), theory=theory, rtol=rtol)
    return getattr(law_made, method)(value)


OF_BODIES = ("E_star", "hardness")
OF_MBMA = ("island_model", "variant", "rtol", "outside")
CALLS: dict[str, Callable[..., Any]] = {
    "contact": contact_call,
    "law": law_call,
    "surface": Surface,
    "sensitivity": sensitivity,
    "flow_factors": flow_factors,
    "island": island,
    "joint": lambda asked, *parts, **options: (
        Joint(*parts, **options).at_pressure(asked).solid_conductance
    ),
}
PART = {"Rq": "0.4 um", "longest": "100 um", "shortest": "2 um", "hurst": 0.8}


def requests(rng: np.random.Generator) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Requests with natural, odd and impossible arguments, without end."""

    def one(values: list[Any]) -> Any:
        return values[rng.integers(len(values))]

    def number() -> Any:
        return one(NATURAL if rng.random() < 0.7 else NUMBERS)

    def some(share: float, *names: str) -> dict[str, Any]:
        return {
            name: one(OPTIONS[name]) for name in names or OPTIONS if rng.random() < share
        }

    def surface() -> Any:
        return one(SURFACES[:3] if rng.random() < 0.8 else SURFACES)

    def answer(name: str, *given: Any, **options: Any) -> tuple[str, Callable[[], Any]]:
        shown = [
            *map(reprlib.repr, given),
            *(f"{key}={reprlib.repr(value)}" for key, value in options.items()),
        ]
        return f"{name}({', '.join(shown)})", functools.partial(
            CALLS[name], *given, **options
        )

    few = ("rtol", "hardness", "E_star", "materials")
    while True:
        known = {one(list(KNOWN)): number()}
        yield answer("contact", surface(), **some(0.12), **known)
        yield answer(
            "law",
            one(list(METHODS)),
            number(),
            surface(),
            one(OPTIONS["theory"][:4]),
            **some(0.15, *few),
        )
        yield answer(
            "surface",
            *(
                one(NUMBERS) if rng.random() < 0.3 else x
                for x in (0.8, 1.0, 100.0, 1.0, 3.0)
            ),
        )
        yield answer("sensitivity", surface(), **known)
        yield answer("flow_factors", surface(), number())
        yield answer(
            "island", surface(), number(), **some(0.15, "rtol", "E_star", "variant")
        )
        part = one([PART, PART | {one(list(PART)): number()}])
        area = one(["4 cm^2", "1 mm^2", number()])
        yield answer(
            "joint",
            one(["10 MPa", number()]),
            part,
            PART,
            bodies=one(METALS),
            nominal_area=area,
        )


def failures(seed: int, scale: float) -> list[Found]:
    """Warnings, untyped errors, values that are not finite, and requests of more than 10 s."""
    count = 0
    refused = 0
    longest = 0.0
    slowest = ""
    bad: dict[str, list[str]] = {
        "a warning": [],
        "an exception other than MbmaError": [],
        f"more than {LONGEST:g} s": [],
    }
    warned, untyped, slow = bad.values()
    for given, call in itertools.islice(
        requests(np.random.default_rng(seed)), int(14000 * scale)
    ):
        start = time.perf_counter()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                call()
        except MbmaError:
            refused += 1
        except Exception as fault:
            found = warned if isinstance(fault, Warning) else untyped
            found.append(f"{given}: {type(fault).__name__}: {fault!s:.200}")
        count = count + 1
        taken = time.perf_counter() - start
        if taken > longest:
            longest = taken
            slowest = f"longest {taken:.2g} s: {given}"
        if taken > LONGEST:
            slow.append(f"{given}: {taken:.2g} s")
    known = ((what, len(own), "\n  ".join(own)) for what, own in bad.items())
    *few, last = (
        Found(f"random requests: {what}", count, refused, size, size, where)
        for what, size, where in known
    )
    return [*few, last._replace(worst=longest, where=last.where or slowest)]


def routes(seed: int, scale: float) -> list[Found]:
    """Differences of each route from a joint's contact, over rounding or the errors that both state."""
    rng = np.random.default_rng(seed)
    rows: dict[str, Found] = {}
    refused = 0
    for _ in range(max(int(ROUTE_QUESTIONS * scale), 1)):
        question = Question.random(rng)
        try:
            reference = Reference(question)
        except MbmaError:
            refused += 1
            _count(rows, "refusals", {"answered": refusals(question)}, question)
            continue
        for name, route in routes_here().items():
            # an error where the joint answers is one more difference
            try:
                misses = route(reference)
            except MbmaError as fault:
                misses = {str(fault): np.array([np.inf])}
            _count(rows, name, misses, question)
    return [row._replace(refused=refused) for row in rows.values()]


def _count(
    rows: dict[str, Found], route: str, misses: Misses, question: Question
) -> None:
    """Add the differences of one question to the row of a route."""
    row = rows.get(route, Found(f"routes: joint and {route}", 0, 0, 0, 0.0, ""))
    for what, ratios in misses.items():
        beyond = int((ratios > 1).sum())
        row = row._replace(answers=row.answers + ratios.size, beyond=row.beyond + beyond)
        if ratios.max(initial=0.0) > row.worst:
            worst = float(ratios.max())
            row = row._replace(worst=worst, where=f"{what}: {question!r}")
    rows[route] = row


@click.command()
@click.option(
    "--seed", type=int, default=1, show_default=True, help="Of the random numbers."
)
@click.option(
    "--scale",
    type=float,
    default=1.0,
    show_default=True,
    help="Factor of the numbers of examples.",
)
@click.option("--only", default="", help="Checks whose names contain this text.")
@click.option("--write", is_flag=True, help="Write the counts to docs/guarantees.md.")
def audit(seed: int, scale: float, only: str, write: bool) -> None:
    """Search for answers beyond their stated error, untested answers that are valid, warnings, errors and hangs."""
    checks: dict[str, Callable[[int, float], list[Found]]] = {
        **{what: functools.partial(bound, what) for what in BOUNDS}, "valid": validity,
        "routes": routes, "requests": failures,
    }  # fmt: skip
    rows = []
    for found in itertools.chain.from_iterable(
        check(seed, scale) for name, check in checks.items() if only in name
    ):
        rows.append(found)
        click.echo(
            f"{found.what:58}{found.answers:8}{found.refused:7}{found.beyond:7}{found.worst:10.3g}"
        )
        if found.beyond or found.worst > 0.9:
            click.echo(f"  {found.where}")
    if write:
        block = f"```\npython -m generate audit --seed {seed} --scale {scale:g} --write\n```\n\n"
        header = "search | answers | refused | beyond | largest"
        write_page(
            "docs/guarantees.md",
            {"audit": block + table(header, (found[:-1] for found in rows), FORMATS)},
            {},
            ROOT,
        )
    if any(found.beyond for found in rows):
        raise SystemExit(1)
