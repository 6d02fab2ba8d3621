"""Laws in Fortran: a module of elemental functions, on top of the C of the law."""

import functools
from collections.abc import Mapping

from mbma_tables.export.code.language import (
    FUNCTIONS,
    MORE,
    NAN,
    AskedLaw,
    Beside,
    Language,
)
from mbma_tables.export.reserved_words import small_words
from mbma_tables.export.text import number

# names of the module itself; the key words of Fortran are not reserved
NAMES = "dp h_max least_overclosure largest_overclosure"


def _reserved() -> frozenset[str]:
    """Words that name no module with these functions."""
    return small_words(NAMES, *(f"c_{function}" for function in FUNCTIONS))


def _public(asked: AskedLaw) -> list[str]:
    """Functions and subroutines of the module."""
    absent = set(MORE) - set(asked.more)
    return [function for function in FUNCTIONS if function not in absent]


def _law_places(asked: AskedLaw, places: Mapping[str, str]) -> dict[str, str]:
    # a line each: a line has 132 letters at most
    return {"PUBLIC": ", &\n    ".join(_public(asked))}


def _functions(asked: AskedLaw) -> dict[str, str]:
    """All functions, which are alike; `with_tangent` is a subroutine."""
    functions = _public(asked)
    functions.remove("with_tangent")
    return dict.fromkeys(functions, "")


LANGUAGES = {
    "fortran-law": Language(
        template="code/languages/law.f90",
        mark="!",
        usage=(
            "Fortran 2008 on top of {name}_c.c, which is written beside it, by `mbma export "
            "c-law`: cc -O2 -c {name}_c.c, gfortran -c {name}.f90, then use {name}; functions "
            f"are elemental, of real(c_double). {NAN}"
        ),
        call="{what}({x})",
        law_places=_law_places,
        number=functools.partial(number, exponent="d", infinity="huge(1d0)"),
        repeated=_functions,
        # the C that the module calls is beside it
        beside=(Beside("_c.c", target="c-law"),),
        alone=False,
        reserved=_reserved,
    )
}
