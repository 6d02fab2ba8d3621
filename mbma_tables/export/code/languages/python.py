"""Laws in Python, for numpy and for jax."""

import functools
import keyword
import sys

from mbma_tables.export.code.language import NAN, Language, Program
from mbma_tables.export.code.polynomials import brackets
from mbma_tables.export.reserved_words import small_words
from mbma_tables.export.text import number

# modules that a module of the same name would hide from numpy and jax
PACKAGES = "numpy jax jaxlib scipy ml_dtypes opt_einsum"


def _reserved() -> frozenset[str]:
    """Words that name no module which imports numpy or jax."""
    return small_words(*keyword.kwlist, *sys.stdlib_module_names, PACKAGES)


def _program(begin: str, *modules: str) -> Program:
    text = f"""\\
{begin}
import numpy as np
import {{{{ laws | join(", ") }}}}
c = np.loadtxt("c.txt", ndmin=1)
values = [
{{% for law, function in asked %}}
    {{{{ law }}}}.{{{{ function }}}}(c),
{{% endfor %}}
]
np.savetxt("values.txt", np.transpose(values), "%.17g")
"""
    return Program("ask.py", text, ("python ask.py",), ".py", modules)


_DOUBLE = 'import jax\njax.config.update("jax_enable_x64", True)'


LANGUAGES = {
    "python-law": Language(
        template="law.py",
        evaluator="law_numpy.py",
        check=("python", "-m", "py_compile", "{file}"),
        mark="#",
        usage=(
            "Python with numpy alone: import {name}; arrays of any shape. Outside the range: "
            "ValueError."
        ),
        call="{name}.{what}({x})",
        program=_program(""),
        number=functools.partial(number, infinity="np.inf", missing="np.nan"),
        array=brackets,
        booleans=("False", "True"),
        parts={"np": "np"},
        reserved=_reserved,
        output="a module that needs numpy only",
        outside="a ValueError",
        tested="numpy 2.4: the same, five laws",
    ),
    "jax-law": Language(
        template="law.py",
        evaluator="law_jax.py",
        check=("python", "-m", "py_compile", "{file}"),
        mark="#",
        usage=(
            "Python with jax alone, differentiable by c, p and the pytree LAW. Set "
            "jax_enable_x64 before the import, or answers are in single precision. "
            f"{NAN}"
        ),
        call="{name}.{what}({x})",
        program=_program(_DOUBLE, "jax"),
        number=functools.partial(number, infinity="jnp.inf", missing="jnp.nan"),
        array=brackets,
        booleans=("False", "True"),
        parts={"np": "jnp"},
        reserved=_reserved,
        output=(
            "a module and a pytree of coefficients; `grad`, `vmap`, `jit`, by the gap, "
            "the pressure and the coefficients; outside the range values and "
            "derivatives are NaN"
        ),
        outside="NaN",
        tested="jax 0.10: the same, three laws",
    ),
}
