"""Closed formulas for a range of one's own, chosen by cross-validation, as text, LaTeX, Python and C.

The logarithm of a result of surfaces is a sum of a few products of letters, which are simple
functions of the arguments, scaled to [-1, 1]; of islands the sum is log_Q of the shipped closed
forms (docs/tables.md). Products are chosen one after the other (orthogonal matching
pursuit), the largest degree by the error on groups of points that a fit has not seen: all gaps of
a surface are in one group, since the points of a curve tell of one another.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import math
import pathlib
import re
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import FloatArray, require_name, whole_number_in
from mbma_tables.common.errors import InputError
from mbma_tables.common.toml_files import check, read_toml
from mbma_tables.contacts.contact import contact
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.island_models import Certificate
from mbma_tables.surfaces.surface import Surface
from mbma_tables.tables.open import universal_model
from mbma_tables.theories.mbma.closed_forms import FUNCTIONS, ClosedForm, evaluate

MOST_TERMS = 60
DEGREES = (2, 3, 4, 5, 6)
FOLDS = 5
LEAST_GROUPS = 2 * FOLDS
LEAST_POINTS = 10  # for each term
SLACK = 1.01  # what rounding of the coefficients may add to the root mean square error
SCALE_DIGITS = 3
DATA_DIGITS = 10
MOST_DIGITS = 15
NAME = re.compile(r"[A-Za-z_]\w*")
HIGHEST_GAP = 0.98  # mean separations of samples, over h_max
LOWEST_GAP = 0.02

EXAMPLE = """\
# mbma tables formula --config range.toml --terms 8
of = "surfaces"             # pressure and area of surfaces; or "islands": Phi_F and Phi_A
theory = "mbma"             # of surfaces: any theory by its name
groups = 300                # random surfaces; of islands, random mu
points = 30                 # gaps of each; of islands, random X
seed = 1

[range]                     # low and high, or one number
hurst = [0.6, 1.0]
zeta_1 = [20, 500]          # q1/q0
h_max_over_h_rms = [3, 4]
area = [1e-3, 0.15]         # contact fractions A/A0 at which the formula must hold

# of islands: X = [0.5, 20], mu = [0.01, 1000]
"""
_SPAN = {
    "anyOf": [
        {"type": "number"},
        {
            "type": "array",
            "items": {"type": "number"},
            "minItems": 2,
            "maxItems": 2,
        },
    ]
}
SURFACE_ARGUMENTS = ("u_over_h_rms", "h_max_over_h_rms", "zeta_1", "hurst")
# what the logarithms of a formula, and surfaces, need
_ABOVE = {"hurst": 0.0, "zeta_1": 1.0, "h_max_over_h_rms": 0.0, "area": 0.0}
_ABOVE |= {"X": -0.5, "mu": 0.0}
_RANGES = {
    "surfaces": ("hurst", "zeta_1", "h_max_over_h_rms", "area"),
    "islands": ("X", "mu"),
}


def _schema(kind: str) -> dict[str, Any]:
    """JSON schema of a configuration."""
    properties: dict[str, Any] = {
        "of": {"enum": [*_RANGES]},
        "groups": {"type": "integer", "minimum": LEAST_GROUPS, "maximum": 20_000},
        "points": {"type": "integer", "minimum": 2, "maximum": 1000},
        "seed": {"type": "integer", "minimum": 0},
        "range": {
            "type": "object",
            "properties": dict.fromkeys(_RANGES[kind], _SPAN),
            "required": [*_RANGES[kind]],
            "additionalProperties": False,
        },
    }
    if kind == "surfaces":
        properties["theory"] = {"type": "string"}
    return {
        "type": "object",
        "properties": properties,
        "required": ["range"],
        "additionalProperties": False,
    }


@dataclasses.dataclass(frozen=True)
class Range:
    """What a formula is made of, and where it must hold."""

    of: str
    #: low and high of each property, the same twice where it is one number
    ranges: Mapping[str, tuple[float, float]]
    theory: str = "mbma"
    groups: int = 300
    points: int = 30
    seed: int = 1

    @property
    def fixed(self) -> set[str]:
        """Properties that have one value."""
        return {name for name, (low, high) in self.ranges.items() if low == high}


def read_range(path: pathlib.Path) -> Range:
    """The range in a TOML file, as in `EXAMPLE`.

    Parameters
    ----------
    path : pathlib.Path
        The file.

    Raises
    ------
    InputError
        For a file that cannot be read, unknown keys, and ranges upside down or beyond what
        the logarithms of a formula need; the message has the file's name.
    """
    entries = read_toml(path, "range")
    kind = entries.get("of", "surfaces")
    try:
        check(entries, _schema(kind if kind in _RANGES else "surfaces"))
        ranges = {}
        for name, span in entries.pop("range").items():
            low, high = span if isinstance(span, list) else (span, span)
            above = _ABOVE[name]
            if not (above < low <= high < math.inf):
                raise InputError(
                    f"[range]: {name} must be a number above {above:g}, or a lower and an "
                    f"upper one, got {span}"
                )
            ranges[name] = (float(low), float(high))
    except InputError as fault:
        raise InputError(f"{path}: {fault}") from None
    return Range(**{"of": kind, **entries, "ranges": ranges})


class Samples(NamedTuple):
    """Points of random groups, of which all are of one surface, or of one mu."""

    arguments: dict[str, FloatArray]
    results: dict[str, FloatArray]
    groups: NDArray[np.intp]


def _drawn(own: Range, count: int, seed: int) -> dict[str, FloatArray]:
    """Properties of groups, (groups, 1), evenly over the range, zeta_1 and mu by their logarithms."""
    from scipy.stats import qmc

    names = [name for name in own.ranges if name not in ("area", "X")]
    places = qmc.Halton(len(names), seed=seed).random(count)
    found = {}
    for name, place in zip(names, places.T, strict=True):
        low, high = own.ranges[name]
        by_log = name in ("zeta_1", "mu")
        value = low * (high / low) ** place if by_log else low + (high - low) * place
        found[name] = value[:, None]
    return found


def _samples(own: Range, count: int, seed: int) -> Samples:
    """Points of so many groups, those within the range."""
    drawn = _drawn(own, count, seed)
    place = np.random.default_rng(seed).uniform(size=(count, own.points))
    if own.of == "islands":
        low, high = own.ranges["X"]
        arguments = {"X": low + (high - low) * place, **drawn}
        phi_F, phi_A, _ = universal_model().answer(arguments["X"], arguments["mu"])
        results = {"phi_F": phi_F, "phi_A": phi_A}
        inside = low <= arguments["X"]
    else:
        top = drawn["h_max_over_h_rms"]
        gap = top * (LOWEST_GAP + (HIGHEST_GAP - LOWEST_GAP) * place)
        surfaces = Surface(drawn["hurst"], 1.0, drawn["zeta_1"], 1.0, top)
        answer = contact(surfaces, mean_separation=gap, theory=own.theory)
        arguments = {"u_over_h_rms": gap, **drawn}
        area = np.asarray(answer.area)
        results = {"pressure": np.asarray(answer.pressure), "area": area}
        low, high = own.ranges["area"]
        inside = (area >= low) & (area <= high)
    groups = np.broadcast_to(np.arange(count)[:, None], place.shape)
    return Samples(
        {n: np.broadcast_to(a, place.shape)[inside] for n, a in arguments.items()},
        {n: a[inside] for n, a in results.items()},
        groups[inside],
    )


class Form(NamedTuple):
    """A formula but for one sum of products."""

    before: dict[str, str]  # steps in Python and C, the letters of the sum among them
    letters: tuple[str, ...]
    total: str  # name of the sum
    last: str  # the result by the sum
    target: FloatArray  # of the sum, at samples


def _of_surfaces(own: Range, result: str, samples: Samples) -> Form:
    """The logarithm of a result as a sum of products of scaled letters."""

    def argument(name: str) -> str:
        return repr(own.ranges[name][0]) if name in own.fixed else name

    top = argument("h_max_over_h_rms")
    letters = {
        "g": ("u_over_h_rms", "u_over_h_rms"),
        "c": ("u_over_h_rms", f"log(1.0 - u_over_h_rms / {top})"),
        "t": ("h_max_over_h_rms", top),
        "z": ("zeta_1", "log(zeta_1)"),
        "h": ("hurst", "hurst"),
    }
    steps = {}
    for symbol, (name, expression) in letters.items():
        if name in own.fixed:
            continue
        values = evaluate({symbol: expression}, samples.arguments)[symbol]
        low = float(np.min(values))
        high = float(np.max(values))
        ends = np.array([low + high, high - low]) / 2
        centre, half_width = rounded(ends, SCALE_DIGITS).tolist()
        sign = "-" if centre >= 0 else "+"
        steps[symbol] = f"({expression} {sign} {abs(centre)!r}) / {half_width!r}"
    total = f"log_{result}"
    target = np.log(samples.results[result])
    return Form(steps, tuple(steps), total, f"exp({total})", target)


def _of_islands(own: Range, result: str, samples: Samples) -> Form:
    """The shipped form of an island, right as mu goes to 0 and for deep ones, whose log_Q is the sum."""
    shipped = FUNCTIONS["standard"][result].steps
    before = {name: repr(own.ranges[name][0]) for name in sorted(own.fixed)}
    for name, text in shipped.items():
        if name == "log_Q":
            break
        before[name] = text
    letters = tuple(name for name in ("u", "t", "z", "v") if name in before)
    X = samples.arguments["X"]
    mu = samples.arguments["mu"]
    which = ("phi_F", "phi_A").index(result)
    exact_rigid = greenwood_tripp.rigid_sphere(X, mu)[which]

    def with_sum(value: str) -> FloatArray:
        steps = {**before, "log_Q": value, result: shipped[result]}
        return np.asarray(evaluate(steps, samples.arguments)[result])

    # the form is rigid/(1 + growth), growth in proportion to exp(log_Q)
    growth = np.expm1(np.log(exact_rigid / samples.results[result]))
    growth_at_0 = with_sum("-700.0") / with_sum("0.0") - 1
    target = np.log(growth / growth_at_0)
    return Form(before, letters, "log_Q", shipped[result], target)


TITLES = {
    "pressure": "F/(A0 E* q0 h_rms) at the mean separation u",
    "area": "contact fraction A/A0 at the mean separation u",
    "phi_F": "force of an island over E* sigma L",
    "phi_A": "area of an island over eta pi D R_u sigma L^2",
}


class Term(NamedTuple):
    """A coefficient, and how often each letter stands in the product; none in the constant."""

    coefficient: float
    powers: dict[str, int]


@dataclasses.dataclass(frozen=True)
class OwnFormula:
    """A closed formula of one result for a range, with its errors."""

    function: ClosedForm  #: arguments and steps, whose last is the result
    degree: int
    cross_validated: float  #: root mean square error of the sum, on groups left out
    certificate: Certificate  #: on groups that neither the choice nor the fit saw

    def __call__(self, **arguments: ArrayLike) -> Any:
        """The result at numbers or arrays by the arguments' names, which broadcast."""
        given = (np.asarray(arguments[name], float) for name in self.function.arguments)
        return self.function(*given)


def rounded(values: FloatArray, digits: int = DATA_DIGITS) -> FloatArray:
    """Values with that many significant digits."""
    flat = [float(f"{value:.{digits}g}") for value in np.ravel(values).tolist()]
    return np.array(flat).reshape(np.shape(values))


def certificate(
    coefficients: int,
    error: FloatArray,
    arguments: Mapping[str, FloatArray],
) -> Certificate:
    """Certificate of held-out relative errors; the largest is rounded up."""
    worst = int(error.argmax())
    # of the third digit of the largest error
    unit = 10.0 ** (math.floor(math.log10(error[worst])) - 2)
    rounded_up = math.ceil(error[worst] / unit) * unit
    return Certificate(
        coefficients,
        largest=float(f"{rounded_up:.3g}"),
        median=float(f"{np.median(error):.3g}"),
        points=error.size,
        worst_at={
            name: float(f"{values[worst]:.4g}") for name, values in arguments.items()
        },
    )


def _chosen(
    values: FloatArray, target: FloatArray, groups: NDArray[np.intp], terms: int
) -> Any:
    """scikit-learn's search: a pipeline for the degree of least error on groups left out."""
    from sklearn.linear_model import OrthogonalMatchingPursuit
    from sklearn.model_selection import GridSearchCV, GroupKFold
    from sklearn.pipeline import Pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    pipeline = Pipeline(
        [
            ("products", PolynomialFeatures(include_bias=False)),
            ("scale", StandardScaler()),
            ("sum", OrthogonalMatchingPursuit(n_nonzero_coefs=terms - 1)),
        ]
    )
    letters = values.shape[1]
    degrees = [d for d in DEGREES if math.comb(letters + d, d) >= terms]
    if not degrees:
        most = math.comb(letters + DEGREES[-1], DEGREES[-1])
        raise InputError(f"terms must be at most {most} for this range, got {terms}")
    search = GridSearchCV(
        pipeline,
        {"products__degree": degrees},
        scoring="neg_root_mean_squared_error",
        cv=GroupKFold(FOLDS),
    )
    with warnings.catch_warnings():
        # products that are combinations of others end a search early, with fewer terms
        warnings.simplefilter("ignore", RuntimeWarning)
        return search.fit(values, target, groups=groups)


def _terms(search: Any, letters: Sequence[str]) -> list[Term]:
    """The terms of the best pipeline, the constant first, then by their effect."""
    products, scale, line = (search.best_estimator_[k] for k in range(3))
    slopes = line.coef_ / scale.scale_
    constant = float(line.intercept_ - slopes @ scale.mean_)
    found = [Term(constant, {})]
    for k in np.argsort(-np.abs(line.coef_)):
        if line.coef_[k]:
            powers = products.powers_[k].tolist()
            named = zip(letters, powers, strict=True)
            found.append(Term(float(slopes[k]), {n: p for n, p in named if p}))
    return found


def _signed(parts: Iterable[tuple[float, str]]) -> str:
    """A sum of products, each a coefficient and the text that multiplies its magnitude."""
    text = "".join(f" {'-' if value < 0 else '+'} {product}" for value, product in parts)
    return (
        text.removeprefix(" + ") if text.startswith(" +") else text.replace(" - ", "-", 1)
    )


def _sum_text(terms: Iterable[Term]) -> str:
    """The sum of terms in Python and C."""
    parts = []
    for value, powers in terms:
        factors = [symbol for symbol, power in powers.items() for _ in range(power)]
        parts.append((value, " * ".join([repr(abs(value)), *factors])))
    return _signed(parts)


def _function(own: Range, result: str, form: Form, terms: Sequence[Term]) -> ClosedForm:
    steps = {**form.before, form.total: _sum_text(terms), result: form.last}
    used = {result}
    needed = {}
    for name, text in reversed(steps.items()):
        if name in used:
            used |= set(NAME.findall(text))
            needed[name] = text
    names = ("X", "mu") if own.of == "islands" else SURFACE_ARGUMENTS
    arguments = tuple(name for name in names if name not in own.fixed)
    in_order = dict(reversed(needed.items()))
    return ClosedForm("own", result, arguments, TITLES[result], in_order)


def _shortest(
    make: Callable[[Sequence[Term]], ClosedForm], terms: Sequence[Term], samples: Samples
) -> list[Term]:
    """Terms of the fewest digits whose error on samples is about that of all digits."""

    def short(digits: int) -> list[Term]:
        values = rounded(np.array([term.coefficient for term in terms]), digits)
        pairs = zip(values.tolist(), terms, strict=True)
        return [Term(value, term.powers) for value, term in pairs]

    def missed(digits: int) -> float:
        error = relative_errors(make(short(digits)), samples)
        return float(np.sqrt(np.mean(error**2)))

    allowed = SLACK * missed(MOST_DIGITS)
    digits = next(
        digits for digits in range(2, MOST_DIGITS + 1) if missed(digits) <= allowed
    )
    return short(digits)


def relative_errors(function: ClosedForm, samples: Samples) -> FloatArray:
    """Magnitudes of a function's relative errors at samples."""
    value = evaluate(function.steps, samples.arguments)[function.result]
    return np.asarray(np.abs(value / samples.results[function.result] - 1))


def _check_enough(samples: Sequence[Samples], terms: int) -> None:
    points = min(each.groups.size for each in samples)
    groups = min(np.unique(each.groups).size for each in samples)
    if points < LEAST_POINTS * terms or groups < FOLDS:
        raise InputError(
            f"{points} points of {groups} groups lie in the range, and {terms} terms need "
            f"{LEAST_POINTS * terms} of {FOLDS}: give more groups or points, or a wider range"
        )


def fit_formula(own: Range, terms: int = 8) -> list[OwnFormula]:
    """Closed formulas of both results of a range, of at most so many terms.

    Parameters
    ----------
    own : Range
        By `read_range`.
    terms : int
        Coefficients of each formula, the constant included, 2 to 60.

    Returns
    -------
    list of OwnFormula
        Of pressure and area of surfaces, or of Phi_F and Phi_A of islands.

    Raises
    ------
    InputError
        Where too few points of the range are in contact as it asks.

    Examples
    --------
    >>> from mbma_tables.export.model.own_formula import Range, fit_formula
    >>> own = Range("islands", {"X": (1.0, 10.0), "mu": (0.1, 10.0)}, groups=60, points=10)
    >>> force, area = fit_formula(own, terms=6)
    >>> force.certificate.largest < 0.05
    True
    """
    count = whole_number_in("terms", terms, 2, MOST_TERMS)
    seen = _samples(own, own.groups, own.seed)
    held_out = _samples(own, max(FOLDS, own.groups // 2), own.seed + 1)
    _check_enough((seen, held_out), count)
    formulas = []
    for result in seen.results:
        make_form = _of_islands if own.of == "islands" else _of_surfaces
        form = make_form(own, result, seen)
        values = evaluate(form.before, seen.arguments)
        matrix = np.stack([values[letter] for letter in form.letters], axis=1)
        search = _chosen(matrix, form.target, seen.groups, count)
        make = functools.partial(_function, own, result, form)
        short = _shortest(make, _terms(search, form.letters), seen)
        function = make(short)
        error = relative_errors(function, held_out)
        places = {name: held_out.arguments[name] for name in function.arguments}
        formulas.append(
            OwnFormula(
                function,
                int(search.best_params_["products__degree"]),
                float(-search.best_score_),
                certificate(len(short), error, places),
            )
        )
    return formulas


# ---- texts ----


def _facts(own: Range, formula: OwnFormula) -> list[str]:
    """What the formula is, where it holds, and its errors, a line each."""
    stated = formula.certificate
    spans = []
    for name, (low, high) in own.ranges.items():
        spans.append(
            f"{name} = {low:g}" if low == high else f"{low:g} <= {name} <= {high:g}"
        )
    source = f"theory {own.theory}" if own.of == "surfaces" else "exact islands"
    worst = ", ".join(f"{name} = {value:g}" for name, value in stated.worst_at.items())
    return [
        f"{formula.function.result}: {formula.function.title}, {source}",
        f"for {', '.join(spans)}",
        f"{stated.coefficients} terms of degree {formula.degree} at most; of their sum the "
        f"cross-validated rms error is {formula.cross_validated:.2g}",
        f"held-out relative error: largest {stated.largest:.2g}, median {stated.median:.2g}, of "
        f"{stated.points} points; largest at {worst}",
    ]


def _as_text(own: Range, formula: OwnFormula) -> str:
    steps = [f"  {name} = {text}" for name, text in formula.function.steps.items()]
    return "\n".join([*_facts(own, formula), *steps])


def _as_python(own: Range, formula: OwnFormula) -> str:
    function = formula.function
    *steps, (_, last) = function.steps.items()
    lines = ["from numpy import exp, log, sqrt", "", ""]
    lines += [f"def {function.result}({', '.join(function.arguments)}):"]
    facts = "\n    ".join(_facts(own, formula))
    lines += [f'    """{facts}"""', *(f"    {name} = {text}" for name, text in steps)]
    return "\n".join([*lines, f"    return {last}"])


def _as_c(own: Range, formula: OwnFormula) -> str:
    function = formula.function
    *steps, (_, last) = function.steps.items()
    facts = "\n * ".join(_facts(own, formula))
    arguments = ", ".join(f"double {name}" for name in function.arguments)
    lines = ["#include <math.h>", "", f"/* {facts} */"]
    lines += [f"double {function.result}({arguments}) {{"]
    lines += [f"    const double {name} = {text};" for name, text in steps]
    return "\n".join([*lines, f"    return {last};", "}"])


LATEX = {
    "u_over_h_rms": r"\frac{u}{h_{\mathrm{rms}}}",
    "h_max_over_h_rms": r"\frac{h_{\max}}{h_{\mathrm{rms}}}",
    "zeta_1": r"\zeta_1",
    "hurst": "H",
    "mu": r"\mu",
    "pressure": r"\frac{F}{A_0 E^* q_0 h_{\mathrm{rms}}}",
    "area": r"\frac{A}{A_0}",
    "phi_F": r"\Phi_F",
    "phi_A": r"\Phi_A",
    "log_Q": "L",
    "log_pressure": "L",
    "log_area": "L",
    "rigid": "R",
}
_OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: r"\,"}


def _latex(node: ast.expr) -> str:
    """An expression of steps in LaTeX."""
    if isinstance(node, ast.Constant):
        mantissa, _, exponent = repr(node.value).partition("e")
        power = rf" \times 10^{{{int(exponent)}}}" if exponent else ""
        return mantissa.removesuffix(".0") + power
    if isinstance(node, ast.Name):
        return LATEX.get(node.id, node.id)
    if isinstance(node, ast.UnaryOp):
        return f"-{_latex(node.operand)}"
    if isinstance(node, ast.Call):
        return _latex_call(node)
    assert isinstance(node, ast.BinOp)
    if isinstance(node.op, ast.Div):
        return rf"\frac{{{_latex(node.left)}}}{{{_latex(node.right)}}}"
    left = _latex_factor(node.left, node.op)
    right = _latex_factor(node.right, node.op)
    return f"{left} {_OPERATORS[type(node.op)]} {right}"


def _latex_factor(node: ast.expr, parent: ast.operator) -> str:
    """An operand, in brackets where it is a sum in a product."""
    is_sum = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)
    if is_sum and isinstance(parent, ast.Mult):
        return rf"\left({_latex(node)}\right)"
    return _latex(node)


def _latex_call(node: ast.Call) -> str:
    assert isinstance(node.func, ast.Name)
    first, *others = map(_latex, node.args)
    if node.func.id == "pow":
        return rf"\left({first}\right)^{{{others[0]}}}"
    if node.func.id == "sqrt":
        return rf"\sqrt{{{first}}}"
    name = {"log": r"\ln", "exp": r"\exp"}[node.func.id]
    return rf"{name}\left({first}\right)"


def _as_latex(own: Range, formula: OwnFormula) -> str:
    lines = [f"% {fact}" for fact in _facts(own, formula)]
    equations = []
    for name, text in formula.function.steps.items():
        right = _latex(ast.parse(text, mode="eval").body)
        equations.append(f"{LATEX.get(name, name)} &= {right}")
    joined = " \\\\\n".join(equations)
    return "\n".join([*lines, r"\begin{align*}", joined, r"\end{align*}"])


WRITERS = {"text": _as_text, "latex": _as_latex, "python": _as_python, "c": _as_c}


def written(own: Range, formulas: Iterable[OwnFormula], language: str) -> str:
    """Formulas in one of `WRITERS`."""
    require_name("language", language, WRITERS)
    return "\n\n".join(WRITERS[language](own, formula) for formula in formulas)
