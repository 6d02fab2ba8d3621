"""Laws in MATLAB and Octave."""

import functools
from collections.abc import Mapping

from mbma_tables.export.code.language import AskedLaw, Language
from mbma_tables.export.code.polynomials import Notation, matrix, polynomial_places
from mbma_tables.export.reserved_words import matlab_words
from mbma_tables.export.text import number, template

TEMPLATE = "code/languages/law.m"

_notation = Notation(functools.partial(number, infinity="Inf"), matrix)


def _reserved() -> frozenset[str]:
    """Words that name no function with a law."""
    return matlab_words(template(TEMPLATE))


def _law_places(asked: AskedLaw, places: Mapping[str, str]) -> dict[str, str]:
    return polynomial_places(asked, _notation)


LANGUAGES = {
    "matlab-law": Language(
        template=TEMPLATE,
        mark="%",
        usage=(
            "MATLAB and Octave: law = {name}(); arrays of any shape. Outside the range: an "
            "error."
        ),
        call="law.{what}({x})",
        law_places=_law_places,
        number=_notation.number,
        # 0/1, or 0/0, which is NaN
        unknown="0./(c(closed) < {})",
        reserved=_reserved,
        unloads=False,
    )
}
