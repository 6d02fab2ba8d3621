"""`python -m generate formulas`: fit the coefficients of the closed forms again, certify them on other samples.

`models/closed_forms.toml` is the one place where the forms are kept; its expressions are Python and C. docs/formula.md
says how the terms were chosen. Samples are rounded, so that the same coefficients come out on all processors.

With Phi_rigid the closed form of the rigid sphere, a function of islands is Phi_rigid/(1 + mu Q(X, mu)), right as
mu -> 0 whatever Q is. Log Q is its own limit at large X, which is the smooth sphere of Hertz, and a sum of terms that
vanish there.

Totals have two branches, which meet where the largest islands reach the floor of zeta_d, at r = k with
r = (h_max - d)/h_rms. Their logarithms are a start, such as the power of first contact, and a sum of products.
"""

import collections
import dataclasses
import functools
import itertools
import math
import re
import textwrap
from collections.abc import Iterable, Mapping
from typing import Any

import click
import numpy as np

from generate.files import ROOT
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models import Certificate
from mbma_tables.models.closed_form_certificates import RANGES
from mbma_tables.models.closed_forms import FUNCTIONS, Function, Steps, evaluate

FORMS = ROOT / "mbma_tables" / "models" / "closed_forms.toml"
MODULE = ROOT / "mbma_tables" / "models" / "closed_form_certificates.py"
NUMBER = re.compile(r"\d[\d.]*(?:e-?\d+)?")
WIDTH = 120
DATA_DIGITS = 10
MIN_DIGITS, MAX_DIGITS = 2, 15  # of a printed constant
LAWSON_ROUNDS = 80
SUMS = ("log_Q", "near", "far")  # steps that have fitted coefficients
SLACK = {"phi": 1.02, "totals": 1.01}  # what rounding may add to the largest error

# islands
SOLVED = 1e-10
MIN_MU = 1e-6
POINTS, HELD_OUT = 3000, 20_000
FIT_SEED, HELD_OUT_SEED = 31, 32
GRID = 300  # a side, of the check that both rise with X
# Phi_rigid mu^-1/(limit of Phi) at large X: (pi/5) X^(5/2) over (4/3) X^(3/2)/sqrt(2), and (pi/2) X^2 over
# (3 pi/8) (3 sqrt(32)/(3 pi))^(2/3) X^(4/3) mu^(-2/3)
HERTZ = (3 * math.sqrt(2) * math.pi / 20, (2 * math.pi**2) ** (1 / 3) / 3)

# totals
MIN_AREA = 1e-6
MARGIN = 0.7  # samples of the fit go down to this share of it
MIN_PENETRATION = 0.03  # r below which no surface of the range reaches MARGIN*MIN_AREA
OVERLAP = 0.02  # of k, by which the samples of the branches overlap
TOTAL_POINTS, TOTAL_HELD_OUT = 40_000, 60_000
EDGE = 0.3  # share of each property that lies on an end of its range, where the error is largest
TOTAL_SEED, TOTAL_HELD_OUT_SEED = 41, 42

Samples = tuple[dict[str, FloatArray], dict[str, FloatArray]]  # arguments and results


def forms_text(text: str, functions: Mapping[str, Mapping[str, Function]]) -> str:
    """The file of the closed forms, below its opening comment."""

    def block(name: str, steps: Iterable[tuple[str, str]]) -> list[str]:
        lines = (textwrap.wrap(f"{step} = {value}", WIDTH, subsequent_indent="    ") for step, value in steps)
        return [f'{name} = """', *itertools.chain.from_iterable(lines), '"""']

    lines = [text.partition("\n\n")[0]]
    for form, results in functions.items():
        # steps with which all functions of a form begin are written once
        every = zip(*(one.steps.items() for one in results.values()), strict=False)
        shared = [first for first, *others in itertools.takewhile(lambda row: len({*row}) == 1, every)]
        arguments = ", ".join(f'"{name}"' for name in next(iter(results.values())).arguments)
        lines += ["", f"[{form}]", f"arguments = [{arguments}]", *block("shared", shared)]
        for result, one in results.items():
            own = [*one.steps.items()][len(shared) :]
            lines += ["", f"[{form}.{result}]", f'title = "{one.title}"', *block("steps", own)]
    return "\n".join([*lines, ""])


def module_text(certificates: Mapping[str, Mapping[str, Certificate]]) -> str:
    """The module of ranges and certificates, the latter by form and result."""
    text, _, _ = MODULE.read_text(encoding="utf-8").partition("CERTIFICATES")
    wrapper = textwrap.TextWrapper(WIDTH, "    ", "        ", break_long_words=False, break_on_hyphens=False)
    lines = [wrapper.fill(f"{form!r}: {row!r},").replace("'", '"') for form, row in certificates.items()]
    return "\n".join([f"{text}CERTIFICATES: dict[str, dict[str, Certificate]] = {{", *lines, "}", ""])


def rounded(values: FloatArray, digits: int = DATA_DIGITS) -> FloatArray:
    """Values with that many significant digits."""
    flat = [float(f"{value:.{digits}g}") for value in np.ravel(values).tolist()]
    return np.array(flat).reshape(np.shape(values))


def terms(text: str) -> list[tuple[str, str]]:
    """Terms of a sum: the fitted coefficient with its sign, or "" where there is none, and the rest.

    A fitted coefficient that is a whole number is written 23e0, any other whole number 23.0.

    Examples
    --------
    >>> terms("-0.5 * u * (v + 1.0) + 1.0 / 2.0 * t - 23e0")
    [('-0.5', 'u * (v + 1.0)'), ('', '+ 1.0 / 2.0 * t'), ('-23e0', '1.0')]
    """
    parts, depth = [["+"]], 0
    for word in text.removeprefix("-").split():
        if depth == 0 and word in "+-":
            parts.append([word])
        else:
            parts[-1].append(word)
        depth += word.count("(") - word.count(")")
    parts[0][0] = "-" if text.startswith("-") else "+"
    found = []
    for sign, first, *rest in parts:
        fitted = NUMBER.fullmatch(first) and not first.endswith(".0")
        found.append((sign + first, " ".join(rest[1:]) or "1.0") if fitted else ("", " ".join([sign, first, *rest])))
    return found


def least_largest(A: FloatArray, target: FloatArray, rounds: int = LAWSON_ROUNDS) -> tuple[float, FloatArray]:
    """Coefficients whose largest error ``|A c - target|`` is least, by Lawson's reweighting; that error and they."""
    weight: Any = np.ones(target.size)
    best, found = math.inf, np.zeros(A.shape[1])
    for _ in range(rounds):
        root = np.sqrt(weight)
        trial = np.linalg.lstsq(A * root[:, None], target * root, rcond=1e-13)[0]
        error = np.abs(A @ trial - target)
        largest = float(error.max())
        if largest < best:
            best, found = largest, trial
        grown = weight * (error / largest + 1e-3)
        weight = np.maximum(grown / grown.mean(), 1e-6)
    return best, found


def certificate(coefficients: int, error: FloatArray, given: Mapping[str, FloatArray]) -> Certificate:
    """Certificate of held-out relative errors; the largest is rounded up."""
    worst = int(error.argmax())
    unit = 10.0 ** (math.floor(math.log10(error[worst])) - 2)
    return Certificate(
        coefficients,
        largest=float(f"{math.ceil(error[worst] / unit) * unit:.3g}"),
        median=float(f"{np.median(error):.3g}"),
        points=error.size,
        worst_at={name: float(f"{values[worst]:.4g}") for name, values in given.items()},
    )


@functools.cache
def islands(form: str, count: int, seed: int) -> Samples:
    """X and mu of the range, a twelfth of them on each edge but mu -> 0, and its corners; exact solves there."""
    (min_X, max_X), (_, max_mu) = RANGES[form]["X"], RANGES[form]["mu"]
    rng = np.random.default_rng(seed)
    x = (min_X + 2) * ((max_X + 2) / (min_X + 2)) ** rng.uniform(size=count) - 2
    mu = np.exp(rng.uniform(math.log(MIN_MU), math.log(max_mu), count))
    share = count // 12
    x[:share], x[share : 2 * share], mu[2 * share : 3 * share] = min_X, max_X, max_mu
    # corners, where fits are worst
    x[-4:], mu[-4:] = [min_X, max_X] * 2, [MIN_MU] * 2 + [max_mu] * 2
    x, mu = rounded(np.clip(x, min_X, max_X)), rounded(mu)
    found = greenwood_tripp.solve(x, mu, rtol=SOLVED)
    rigid = greenwood_tripp.rigid_sphere(x, mu)
    phi = rigid * np.exp(rounded(np.log(np.stack([found.phi_F, found.phi_A]) / rigid)))
    return {"X": x, "mu": mu}, dict(zip(("phi_F", "phi_A"), phi, strict=True))


@functools.cache
def totals(count: int, seed: int, min_area: float = MIN_AREA) -> Samples:
    """Random surfaces and gaps, a share of each property on the ends of its range, where contact is above `min_area`.

    Force and area by the universal table (error 1e-8).
    """
    rng, ranges = np.random.default_rng(seed), RANGES["totals"]

    def drawn(low: float, high: float) -> FloatArray:
        place = rng.uniform(-EDGE / 2, 1 + EDGE / 2, count)
        return low + (high - low) * np.clip(place, 0.0, 1.0)

    hurst = drawn(*ranges["hurst"])
    zeta_1 = np.clip(np.exp(drawn(*np.log(ranges["zeta_1"]))), *ranges["zeta_1"])
    top = drawn(*ranges["h_max_over_h_rms"])
    r = np.minimum(np.exp(rng.uniform(np.log(MIN_PENETRATION), np.log(2 * top))), 2 * top)
    part = rng.uniform(size=count)
    # full compression; evenly in d; and where the branches meet, which no random point hits
    r = np.where(part < 0.03, 2 * top, np.where(part < 0.35, rng.uniform(0.1, 1.0, count) * 2 * top, r))
    meet = 2.25 * np.sqrt(1.5 ** (-2 * hurst) - zeta_1 ** (-2 * hurst)) * rng.uniform(1 - OVERLAP, 1 + OVERLAP, count)
    r = np.where(part > 0.9, meet, r)
    top, zeta_1, hurst = (rounded(values) for values in (top, zeta_1, hurst))
    # full compression stays within -h_max as top is rounded before r is taken off it
    gap = np.maximum(rounded(top - r), -top)
    found = contact(Surface(hurst, 1.0, zeta_1, 1.0, top), separation=gap)
    kept = found.area > min_area
    given = {"d_over_h_rms": gap, "h_max_over_h_rms": top, "zeta_1": zeta_1, "hurst": hurst}
    results = {"pressure": np.asarray(found.pressure), "area": np.asarray(found.area)}
    return {name: a[kept] for name, a in given.items()}, {name: a[kept] for name, a in results.items()}


def log_Q(which: int, X: FloatArray, mu: FloatArray, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Log Q less its limit at large X, and how much of an error of log Q is one of log Phi."""
    growth = np.expm1(rounded(np.log(greenwood_tripp.rigid_sphere(X, mu)[which] / phi)))
    limit = np.log(HERTZ[which] * (X + 1)) - (np.log1p(mu * (X + 1)) / 3 if which else 0)
    return np.log(growth / mu) - limit, growth / (1 + growth)


def coefficients(function: Function, name: str, text: str) -> FloatArray:
    """Coefficients of the terms of one sum of a function, of least largest error."""
    start = " ".join(rest for number, rest in terms(text) if not number)
    products = [collections.Counter(re.findall(r"[a-z]\w*", rest)) for number, rest in terms(text) if number]
    if name == "log_Q":
        given, truth = islands(function.form, POINTS, FIT_SEED)
        which = ("phi_F", "phi_A").index(function.result)
        target, weight = log_Q(which, given["X"], given["mu"], truth[function.result])
        named = evaluate(function.steps, given)
    else:
        given, truth = totals(TOTAL_POINTS, TOTAL_SEED, MARGIN * MIN_AREA)
        named = evaluate({**function.steps, "start": start}, given)
        place = named["r"] / named["k"]
        mine = place > 1 - OVERLAP if name == "far" else place < 1 + OVERLAP
        target = rounded((np.log(truth[function.result]) - named["start"])[mine])
        used = set[str]().union(*products)
        named, weight = {letter: rounded(named[letter][mine]) for letter in used}, np.ones(target.size)
    columns = []
    for product in products:
        factors = (named[letter] ** power for letter, power in product.items())
        columns.append(functools.reduce(np.multiply, factors, np.ones_like(target)) * weight)

    def place_of(k: int) -> tuple[Any, ...]:
        own = products[k]
        return "v" in own, "z" in own and "u" in own, "z" not in own, own["u"], own.total()

    # the last digits of a fit depend on the order of its terms
    order = sorted(range(len(products)), key=place_of)
    found = np.empty(len(products))
    found[order] = least_largest(np.stack(columns, axis=1)[:, order], target * weight)[1]
    return found


def refitted(function: Function, fits: Mapping[str, FloatArray], digits: int) -> Steps:
    """The steps of a function with these coefficients, of so many digits."""

    def text_of(text: str, fitted: FloatArray) -> str:
        values, parts = iter(rounded(fitted, digits).tolist()), list[str]()
        for number, rest in terms(text):
            part = rest
            if number:
                value = next(values)
                shown = f"{abs(value):.0f}e0" if value.is_integer() else repr(abs(value))
                part = f"{'-' if value < 0 else '+'} {shown}{'' if rest == '1.0' else f' * {rest}'}"
            parts.append(part)
        joined = " ".join(parts)
        return joined.removeprefix("+ ") if joined.startswith("+") else joined.replace("- ", "-", 1)

    return {name: text_of(text, fits[name]) if name in fits else text for name, text in function.steps.items()}


def rises(steps: Steps, result: str, ranges: Mapping[str, tuple[float, float]]) -> bool:
    """Whether a function of islands is positive and rises with X, on a grid of the range."""
    x, mu = np.linspace(*ranges["X"], GRID), np.geomspace(MIN_MU, ranges["mu"][1], GRID)
    field = evaluate(steps, dict(zip(("X", "mu"), np.meshgrid(x, mu, indexing="ij"), strict=True)))[result]
    return bool((field > 0).all() and (np.diff(field, axis=0) > 0).all())


def certified(function: Function) -> tuple[Function, Certificate]:
    """A function with coefficients fitted again, as short as its error allows, and its certificate."""
    fits = {name: coefficients(function, name, text) for name, text in function.steps.items() if name in SUMS}
    is_total = function.form == "totals"
    if is_total:
        sets = [totals(TOTAL_POINTS, TOTAL_SEED), totals(TOTAL_HELD_OUT, TOTAL_HELD_OUT_SEED)]
    else:
        sets = [islands(function.form, *some) for some in ((POINTS, FIT_SEED), (HELD_OUT, HELD_OUT_SEED))]

    def errors(steps: Steps, samples: Samples) -> FloatArray:
        given, truth = samples
        return np.asarray(np.abs(evaluate(steps, given)[function.result] / truth[function.result] - 1))

    def largest(digits: int) -> float:
        return float(errors(refitted(function, fits, digits), sets[0]).max())

    allowed = SLACK["totals" if is_total else "phi"] * largest(MAX_DIGITS)
    digits = next(digits for digits in itertools.count(MIN_DIGITS) if largest(digits) <= allowed)
    steps = refitted(function, fits, digits)
    if not is_total and not rises(steps, function.result, RANGES[function.form]):
        raise RuntimeError(f"{function.result} of the {function.form} form does not rise with X everywhere")
    # an island's c, and b and g where they are used, beside the coefficients
    shape = 0 if is_total else 1 + sum(name in ("y", "v") for name in steps)
    found = certificate(shape + sum(map(len, fits.values())), errors(steps, sets[1]), sets[1][0])
    title = re.sub(r"within .*", f"within {found.largest:g}.", function.title)
    return dataclasses.replace(function, steps=steps, title=title), found


@click.command()
def formulas() -> None:
    """Fit and certify the closed forms; write them and the Python module of their certificates (a minute)."""
    fitted: dict[str, dict[str, Function]] = {form: {} for form in RANGES}
    certificates: dict[str, dict[str, Certificate]] = {form: {} for form in RANGES}
    for form, result in ((form, result) for form, results in FUNCTIONS.items() for result in results):
        fitted[form][result], certificates[form][result] = certified(FUNCTIONS[form][result])
        click.echo(f"{form} {result}: largest held-out error {certificates[form][result].largest:.2e}")
    write_file(FORMS, forms_text(FORMS.read_text(encoding="utf-8"), fitted).encode())
    write_file(MODULE, module_text(certificates).encode())
    click.echo(MODULE)
