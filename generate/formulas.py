"""`python -m generate formulas`: fit the closed forms again, certify them on other samples.

`theories/mbma/closed_forms.toml` is the one place where the forms are kept; its expressions
are Python and C. docs/model.md says how the terms were chosen. Samples are rounded, so
that the same coefficients come out on all processors.

With Phi_rigid the closed form of the rigid sphere, a function of islands is Phi_rigid/(1 + mu Q(X,
mu)), right as mu -> 0 whatever Q is. Log Q is its own limit at large X, which is the smooth sphere
of Hertz, and a sum of terms that vanish there.

Totals have two branches, which meet where the largest islands reach the floor of zeta_d, at r = k
with r = (h_max - d)/h_rms. Their logarithms are a start, such as the power of first contact, and a
sum of products.
"""

import collections
import dataclasses
import functools
import itertools
import math
import re
import textwrap
from collections.abc import Iterable, Mapping

import click
import numpy as np
from numpy.typing import NDArray

from generate.files import ROOT
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file
from mbma_tables.export.model.own_formula import certificate, rounded
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.island_models import Certificate
from mbma_tables.theories.mbma.closed_form_certificates import RANGES
from mbma_tables.theories.mbma.closed_forms import FUNCTIONS, ClosedForm, Steps, evaluate

FORMS = ROOT / "mbma_tables" / "theories" / "mbma" / "closed_forms.toml"
MODULE = ROOT / "mbma_tables" / "theories" / "mbma" / "closed_form_certificates.py"
NUMBER = re.compile(r"\d[\d.]*(?:e-?\d+)?")
WIDTH = 120
# of a printed constant
MIN_DIGITS = 2
MAX_DIGITS = 15
LAWSON_ROUNDS = 80
SUMS = ("log_Q", "near", "far")  # steps that have fitted coefficients
SLACK = {"phi": 1.02, "totals": 1.01}  # what rounding may add to the largest error

# islands
SOLVED = 1e-10
MIN_MU = 1e-6
POINTS = 3000
HELD_OUT = 20_000
FIT_SEED = 31
HELD_OUT_SEED = 32
GRID = 300  # a side, of the check that both rise with X
# Phi_rigid mu^-1/(limit of Phi) at large X: (pi/5) X^(5/2) over (4/3) X^(3/2)/sqrt(2), and (pi/2)
# X^2 over (3 pi/8) (3 sqrt(32)/(3 pi))^(2/3) X^(4/3) mu^(-2/3)
HERTZ = (3 * math.sqrt(2) * math.pi / 20, (2 * math.pi**2) ** (1 / 3) / 3)

# totals
MIN_AREA = 1e-6
MARGIN = 0.7  # samples of the fit go down to this share of it
MIN_PENETRATION = 0.03  # r below which no surface of the range reaches MARGIN*MIN_AREA
OVERLAP = 0.02  # of k, by which the samples of the branches overlap
TOTAL_POINTS = 40_000
TOTAL_HELD_OUT = 60_000
EDGE = 0.3  # share of each property that lies on an end of its range, where the error is largest
TOTAL_SEED = 41
TOTAL_HELD_OUT_SEED = 42

Samples = tuple[dict[str, FloatArray], dict[str, FloatArray]]  # arguments and results


def wrapped_steps(name: str, steps: Iterable[tuple[str, str]]) -> list[str]:
    """Lines of a text of the file that has a step a line, each wrapped."""
    lines = [f'{name} = """']
    for step, value in steps:
        lines += textwrap.wrap(f"{step} = {value}", WIDTH, subsequent_indent="    ")
    return [*lines, '"""']


def shared_steps(functions: Iterable[ClosedForm]) -> list[tuple[str, str]]:
    """Steps with which all functions of a form begin."""
    shared = []
    steps_of_functions = (function.steps.items() for function in functions)
    for first, *others in zip(*steps_of_functions, strict=False):
        if any(other != first for other in others):
            break
        shared.append(first)
    return shared


def forms_text(text: str, functions: Mapping[str, Mapping[str, ClosedForm]]) -> str:
    """The file of the closed forms, below its opening comment."""
    opening = text.partition("\n\n")[0]
    lines = [opening]
    for form, results in functions.items():
        # steps with which all functions of a form begin are written once
        shared = shared_steps(results.values())
        first_function = next(iter(results.values()))
        arguments = ", ".join(f'"{name}"' for name in first_function.arguments)
        lines += ["", f"[{form}]", f"arguments = [{arguments}]"]
        lines += wrapped_steps("shared", shared)
        for result, function in results.items():
            further_steps = list(function.steps.items())[len(shared) :]
            lines += ["", f"[{form}.{result}]", f'title = "{function.title}"']
            lines += wrapped_steps("steps", further_steps)
    return "\n".join([*lines, ""])


def module_text(certificates: Mapping[str, Mapping[str, Certificate]]) -> str:
    """The module of ranges and certificates, the latter by form and result."""
    # what stands above the certificates stays as it is
    ranges, _, _ = MODULE.read_text(encoding="utf-8").partition("CERTIFICATES")
    wrapper = textwrap.TextWrapper(
        WIDTH,
        initial_indent="    ",
        subsequent_indent="        ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    lines = [f"{ranges}CERTIFICATES: dict[str, dict[str, Certificate]] = {{"]
    for form, row in certificates.items():
        lines.append(wrapper.fill(f"{form!r}: {row!r},").replace("'", '"'))
    return "\n".join([*lines, "}", ""])


def terms(text: str) -> list[tuple[str, str]]:
    """Terms of a sum: the fitted coefficient with its sign, "" where there is none, and the rest.

    A fitted coefficient that is a whole number is written 23e0, any other whole number 23.0.

    Examples
    --------
    >>> terms("-0.5 * u * (v + 1.0) + 1.0 / 2.0 * t - 23e0")
    [('-0.5', 'u * (v + 1.0)'), ('', '+ 1.0 / 2.0 * t'), ('-23e0', '1.0')]
    """
    # words of each term, of which the first is its sign
    words_of_terms = [["-" if text.startswith("-") else "+"]]
    open_brackets = 0
    for word in text.removeprefix("-").split():
        # a sign within brackets begins no term
        if open_brackets == 0 and word in "+-":
            words_of_terms.append([word])
        else:
            words_of_terms[-1].append(word)
        open_brackets += word.count("(") - word.count(")")

    split_terms = []
    for sign, first, *rest in words_of_terms:
        is_fitted = NUMBER.fullmatch(first) and not first.endswith(".0")
        if is_fitted:
            # the first of the rest is the sign of multiplication
            factors = " ".join(rest[1:]) or "1.0"
            split_terms.append((sign + first, factors))
        else:
            split_terms.append(("", " ".join([sign, first, *rest])))
    return split_terms


def least_largest(
    A: FloatArray,
    target: FloatArray,
    rounds: int = LAWSON_ROUNDS,
) -> tuple[float, FloatArray]:
    """Least largest error ``|A c - target|``, by Lawson's reweighting, and its coefficients."""
    weight: NDArray[np.floating] = np.ones(target.size)
    least_error = math.inf
    best_coefficients: FloatArray = np.zeros(A.shape[1])
    for _ in range(rounds):
        root = np.sqrt(weight)
        trial = np.linalg.lstsq(A * root[:, None], target * root, rcond=1e-13)[0]
        error = np.abs(A @ trial - target)
        largest = float(error.max())
        if largest < least_error:
            least_error = largest
            best_coefficients = trial
        # points of large error weigh more in the next round, and none weighs nothing
        grown = weight * (error / largest + 1e-3)
        weight = np.maximum(grown / grown.mean(), 1e-6)
    return least_error, best_coefficients


@functools.cache
def islands(form: str, count: int, seed: int) -> Samples:
    """X and mu of the range, with exact solves there.

    A twelfth of them lies on each edge but mu -> 0, and some on its corners.
    """
    min_X, max_X = RANGES[form]["X"]
    _, max_mu = RANGES[form]["mu"]
    rng = np.random.default_rng(seed)
    # evenly in ln(X + 2) and ln mu
    x = (min_X + 2) * ((max_X + 2) / (min_X + 2)) ** rng.uniform(size=count) - 2
    mu = np.exp(rng.uniform(math.log(MIN_MU), math.log(max_mu), count))
    share = count // 12
    x[:share] = min_X
    x[share : 2 * share] = max_X
    mu[2 * share : 3 * share] = max_mu
    # corners, where fits are worst
    x[-4:] = [min_X, max_X, min_X, max_X]
    mu[-4:] = [MIN_MU, MIN_MU, max_mu, max_mu]
    x = rounded(np.clip(x, min_X, max_X))
    mu = rounded(mu)
    solved = greenwood_tripp.solve(x, mu, rtol=SOLVED)
    rigid = greenwood_tripp.rigid_sphere(x, mu)
    # the last digits of a solve depend on the machine
    log_ratio = rounded(np.log(np.stack([solved.phi_F, solved.phi_A]) / rigid))
    phi_F, phi_A = rigid * np.exp(log_ratio)
    return {"X": x, "mu": mu}, {"phi_F": phi_F, "phi_A": phi_A}


@functools.cache
def totals(count: int, seed: int, min_area: float = MIN_AREA) -> Samples:
    """Random surfaces and gaps at which contact is above `min_area`, some on the ends of ranges.

    Force and area by the universal table (error 1e-8).
    """
    rng = np.random.default_rng(seed)
    ranges = RANGES["totals"]

    def drawn(low: float, high: float) -> FloatArray:
        place = rng.uniform(-EDGE / 2, 1 + EDGE / 2, count)
        return low + (high - low) * np.clip(place, 0.0, 1.0)

    hurst = drawn(*ranges["hurst"])
    zeta_1 = np.clip(np.exp(drawn(*np.log(ranges["zeta_1"]))), *ranges["zeta_1"])
    top = drawn(*ranges["h_max_over_h_rms"])
    # penetrations r = top - d: most of them evenly in ln r
    log_r = rng.uniform(np.log(MIN_PENETRATION), np.log(2 * top))
    r = np.minimum(np.exp(log_r), 2 * top)
    part = rng.uniform(size=count)
    # a third of them evenly in d, and full compression
    even_in_d = rng.uniform(0.1, 1.0, count) * 2 * top
    r = np.where(part < 0.03, 2 * top, np.where(part < 0.35, even_in_d, r))
    # and a tenth where the branches meet, which no random point hits
    meet = 2.25 * np.sqrt(1.5 ** (-2 * hurst) - zeta_1 ** (-2 * hurst))
    meet = meet * rng.uniform(1 - OVERLAP, 1 + OVERLAP, count)
    r = np.where(part > 0.9, meet, r)

    top = rounded(top)
    zeta_1 = rounded(zeta_1)
    hurst = rounded(hurst)
    # full compression stays within -h_max as top is rounded before r is taken off it
    gap = np.maximum(rounded(top - r), -top)
    answer = contact(Surface(hurst, 1.0, zeta_1, 1.0, top), separation=gap)
    enough = answer.area > min_area
    arguments = {
        "d_over_h_rms": gap,
        "h_max_over_h_rms": top,
        "zeta_1": zeta_1,
        "hurst": hurst,
    }
    results = {"pressure": np.asarray(answer.pressure), "area": np.asarray(answer.area)}
    return (
        {name: values[enough] for name, values in arguments.items()},
        {name: values[enough] for name, values in results.items()},
    )


def log_Q(
    which: int,
    X: FloatArray,
    mu: FloatArray,
    phi: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Log Q less its limit at large X, and how much of an error of log Q is one of log Phi.

    `which` is 0 for Phi_F, 1 for Phi_A.
    """
    rigid = greenwood_tripp.rigid_sphere(X, mu)[which]
    growth = np.expm1(rounded(np.log(rigid / phi)))
    # that of Phi_A has the factor (1 + mu (X + 1))^(-1/3)
    log_factor = np.log1p(mu * (X + 1)) / 3 if which else 0
    limit = np.log(HERTZ[which] * (X + 1)) - log_factor
    return np.log(growth / mu) - limit, growth / (1 + growth)


def _place_in_fit(product: collections.Counter[str]) -> tuple[bool, bool, bool, int, int]:
    return (
        "v" in product,
        "z" in product and "u" in product,
        "z" not in product,
        product["u"],
        product.total(),
    )


def samples_of_islands(
    function: ClosedForm,
) -> tuple[Mapping[str, FloatArray], FloatArray, FloatArray]:
    """Values of the steps, the target of the sum log_Q, and the weights of its errors."""
    arguments, truth = islands(function.form, POINTS, FIT_SEED)
    which = ("phi_F", "phi_A").index(function.result)
    target, weight = log_Q(which, arguments["X"], arguments["mu"], truth[function.result])
    return evaluate(function.steps, arguments), target, weight


def samples_of_totals(
    function: ClosedForm,
    branch: str,
    start: str,
    letters: Iterable[str],
) -> tuple[Mapping[str, FloatArray], FloatArray, FloatArray]:
    """Values of these letters, the target of the sum of a branch, and the weights of its errors.

    `start` has the terms of the sum that are not fitted.
    """
    arguments, truth = totals(TOTAL_POINTS, TOTAL_SEED, MARGIN * MIN_AREA)
    values_of_steps = evaluate({**function.steps, "start": start}, arguments)
    place = values_of_steps["r"] / values_of_steps["k"]
    on_branch = place > 1 - OVERLAP if branch == "far" else place < 1 + OVERLAP
    remainder = np.log(truth[function.result]) - values_of_steps["start"]
    target = rounded(remainder[on_branch])
    on_samples = {
        letter: rounded(values_of_steps[letter][on_branch]) for letter in letters
    }
    return on_samples, target, np.ones(target.size)


def coefficients(function: ClosedForm, name: str, text: str) -> FloatArray:
    """Coefficients of the terms of one sum of a function, of least largest error."""
    split_terms = terms(text)
    start = " ".join(rest for number, rest in split_terms if not number)
    # powers of the letters of each fitted term
    products = []
    for number, rest in split_terms:
        if number:
            products.append(collections.Counter(re.findall(r"[a-z]\w*", rest)))

    if name == "log_Q":
        values_of_steps, target, weight = samples_of_islands(function)
    else:
        letters = set[str]().union(*products)
        values_of_steps, target, weight = samples_of_totals(
            function, name, start, letters
        )

    columns = []
    for product in products:
        factors = (values_of_steps[letter] ** power for letter, power in product.items())
        column = functools.reduce(np.multiply, factors, np.ones_like(target))
        columns.append(column * weight)

    # the last digits of a fit depend on the order of its terms
    order = sorted(range(len(products)), key=lambda k: _place_in_fit(products[k]))
    matrix = np.stack(columns, axis=1)[:, order]
    _, in_order = least_largest(matrix, target * weight)
    in_terms = np.empty(len(products))
    in_terms[order] = in_order
    return in_terms


def sum_text(text: str, fitted: FloatArray) -> str:
    """A sum with these fitted coefficients in place of its own."""
    values = iter(fitted.tolist())
    parts = []
    for number, rest in terms(text):
        if not number:
            parts.append(rest)
            continue
        value = next(values)
        sign = "-" if value < 0 else "+"
        # whole numbers are marked as fitted by their exponent
        digits = f"{abs(value):.0f}e0" if value.is_integer() else repr(abs(value))
        factors = "" if rest == "1.0" else f" * {rest}"
        parts.append(f"{sign} {digits}{factors}")
    joined = " ".join(parts)
    # the sign of the first term: none, or without a space
    if joined.startswith("+"):
        return joined.removeprefix("+ ")
    return joined.replace("- ", "-", 1)


def refitted(function: ClosedForm, fits: Mapping[str, FloatArray], digits: int) -> Steps:
    """The steps of a function with these coefficients, of so many digits."""
    steps = {}
    for name, text in function.steps.items():
        steps[name] = (
            sum_text(text, rounded(fits[name], digits)) if name in fits else text
        )
    return steps


def rises(steps: Steps, result: str, ranges: Mapping[str, tuple[float, float]]) -> bool:
    """Whether a function of islands is positive and rises with X, on a grid of the range."""
    x = np.linspace(*ranges["X"], GRID)
    mu = np.geomspace(MIN_MU, ranges["mu"][1], GRID)
    grid_of_x, grid_of_mu = np.meshgrid(x, mu, indexing="ij")
    field = evaluate(steps, {"X": grid_of_x, "mu": grid_of_mu})[result]
    is_positive = (field > 0).all()
    return bool(is_positive and (np.diff(field, axis=0) > 0).all())


def relative_errors(function: ClosedForm, steps: Steps, samples: Samples) -> FloatArray:
    """Magnitudes of the relative errors of a function with these steps."""
    arguments, truth = samples
    value = evaluate(steps, arguments)[function.result]
    return np.asarray(np.abs(value / truth[function.result] - 1))


def shortest(
    function: ClosedForm, fits: Mapping[str, FloatArray], samples: Samples
) -> Steps:
    """Steps with coefficients of the fewest digits whose largest error is about that of all."""

    def largest(digits: int) -> float:
        return float(
            relative_errors(function, refitted(function, fits, digits), samples).max()
        )

    slack = SLACK["totals" if function.form == "totals" else "phi"]
    allowed = slack * largest(MAX_DIGITS)
    digits = next(
        digits for digits in itertools.count(MIN_DIGITS) if largest(digits) <= allowed
    )
    return refitted(function, fits, digits)


def certified(function: ClosedForm) -> tuple[ClosedForm, Certificate]:
    """A function with coefficients fitted again, as short as errors allow, and its certificate."""
    fits = {}
    for name, text in function.steps.items():
        if name in SUMS:
            fits[name] = coefficients(function, name, text)

    is_total = function.form == "totals"
    if is_total:
        seen = totals(TOTAL_POINTS, TOTAL_SEED)
        held_out = totals(TOTAL_HELD_OUT, TOTAL_HELD_OUT_SEED)
    else:
        seen = islands(function.form, POINTS, FIT_SEED)
        held_out = islands(function.form, HELD_OUT, HELD_OUT_SEED)

    steps = shortest(function, fits, seen)
    if not is_total and not rises(steps, function.result, RANGES[function.form]):
        message = f"{function.result} of the {function.form} form does not rise with X everywhere"
        raise RuntimeError(message)

    # an island's c, and b and g where they are used, beside the coefficients
    shape_constants = 0 if is_total else 1 + sum(name in ("y", "v") for name in steps)
    count = shape_constants + sum(map(len, fits.values()))
    arguments, _ = held_out
    stated = certificate(count, relative_errors(function, steps, held_out), arguments)
    title = re.sub(r"within .*", f"within {stated.largest:g}.", function.title)
    return dataclasses.replace(function, steps=steps, title=title), stated


@click.command()
def formulas() -> None:
    """Fit and certify the closed forms; write them and the module of their certificates (a minute)."""
    fitted: dict[str, dict[str, ClosedForm]] = {form: {} for form in RANGES}
    certificates: dict[str, dict[str, Certificate]] = {form: {} for form in RANGES}
    for form, results in FUNCTIONS.items():
        for result, shipped in results.items():
            function, stated = certified(shipped)
            fitted[form][result] = function
            certificates[form][result] = stated
            click.echo(f"{form} {result}: largest held-out error {stated.largest:.2e}")
    text = FORMS.read_text(encoding="utf-8")
    write_file(FORMS, forms_text(text, fitted).encode())
    write_file(MODULE, module_text(certificates).encode())
    click.echo(MODULE)
