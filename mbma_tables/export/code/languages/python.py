"""Laws in Python, for numpy and for jax."""

import functools
import keyword
import sys
from collections.abc import Mapping

from mbma_tables.export.code.language import NAN, AskedLaw, Language
from mbma_tables.export.code.polynomials import Notation, brackets, polynomial_places
from mbma_tables.export.reserved_words import small_words
from mbma_tables.export.text import number

# modules that a module of the same name would hide from numpy and jax
PACKAGES = "numpy jax jaxlib scipy ml_dtypes opt_einsum"

_of_numpy = Notation(functools.partial(number, infinity="np.inf"), brackets)
_of_jax = Notation(functools.partial(number, infinity="jnp.inf"), brackets)


def _reserved() -> frozenset[str]:
    """Words that name no module which imports numpy or jax."""
    return small_words(*keyword.kwlist, *sys.stdlib_module_names, PACKAGES)


def _places_of_numpy(asked: AskedLaw, places: Mapping[str, str]) -> dict[str, str]:
    return polynomial_places(asked, _of_numpy)


def _places_of_jax(asked: AskedLaw, places: Mapping[str, str]) -> dict[str, str]:
    return polynomial_places(asked, _of_jax)


LANGUAGES = {
    "python-law": Language(
        template="code/languages/law.py",
        mark="#",
        usage=(
            "Python with numpy alone: import {name}; arrays of any shape. Outside the range: "
            "ValueError."
        ),
        call="{name}.{what}({x})",
        law_places=_places_of_numpy,
        number=_of_numpy.number,
        unknown="np.where(c >= {}, np.nan, 0.0)",
        parts={"NP": "np", "NUMPY": "asked", "JAX": ""},
        reserved=_reserved,
        unloads=False,
    ),
    "jax-law": Language(
        template="code/languages/law.py",
        mark="#",
        usage=(
            "Python with jax alone, differentiable by c, p and the pytree LAW. Set "
            "jax_enable_x64 before the import, or answers are in single precision. "
            f"{NAN}"
        ),
        call="{name}.{what}({x})",
        law_places=_places_of_jax,
        number=_of_jax.number,
        unknown="jnp.where(c >= {}, jnp.nan, 0.0)",
        parts={"NP": "jnp", "NUMPY": "", "JAX": "asked"},
        reserved=_reserved,
        unloads=False,
    ),
}
