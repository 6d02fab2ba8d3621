"""Laws in Modelica: a package with the law's functions, and their derivatives."""

import functools
import re
from collections.abc import Mapping

from mbma_tables.export.code.language import AskedLaw, Language
from mbma_tables.export.code.polynomials import (
    Notation,
    braces,
    law_places,
    polynomial_places,
)
from mbma_tables.export.reserved_words import small_words, words_of_code
from mbma_tables.export.text import filled, number, template

TEMPLATE = "code/languages/law.mo"
# Modelica 3.6, sections 2.3.3, 3.7 and 4.9: key words, functions and types that are always
# there
KEYWORDS = """
    algorithm and annotation assert block break class connect connector constant constrainedby der
    discrete each else elseif elsewhen encapsulated end enumeration equation expandable extends
    external false final flow for function if import impure in initial inner input loop model not
    operator or outer output package parameter partial protected public pure record redeclare
    replaceable return stream then true type when while within
    Real Integer Boolean String AssertionLevel Clock Complex ExternalObject Modelica StateSelect
    Connections abs sign sqrt div mod rem ceil floor integer sin cos tan asin acos atan atan2 sinh
    cosh tanh exp log log10 time delay cardinality homotopy semiLinear inStream actualStream
    spatialDistribution getInstanceName terminal sample pre edge change reinit terminate noEvent
    smooth promote ndims size scalar vector matrix identity diagonal zeros ones fill linspace min
    max sum product transpose outerProduct symmetric cross skew array cat interval hold previous
    subSample superSample shiftSample backSample noClock
"""
# what the text of a package names: constants, and functions
_DEFINED = re.compile(r"\b(?<!type )(\w+)(?:\[[^]]*\])? = [-\d{]|function (\w+)")

_notation = Notation(functools.partial(number, infinity="1.0e300"), braces)


def _reserved() -> frozenset[str]:
    """Words that name no package with a law."""
    return small_words(KEYWORDS, "elastic", words_of_code(template(TEMPLATE), "//"))


def _law_places(asked: AskedLaw, places: Mapping[str, str]) -> dict[str, str]:
    """The polynomials; of contact that yields with a package of the elastic law inside."""
    polynomials = polynomial_places(asked, _notation)
    if not asked.yields:
        return polynomials | {"SLOPED": "tangent"}
    elastic = law_places(asked.sloped, _notation)
    only = {"NAME": "elastic", "HEADER": "", "LEAKAGE": "", "GAS": "", "ELASTIC": ""}
    text = filled(
        TEMPLATE, each={}, **{**places, **polynomials, **elastic, **only}
    ).strip()
    # some tools confuse names of a package with those of one in it
    names = "|".join(
        constant or function for constant, function in _DEFINED.findall(text)
    )
    nested = re.sub(rf"\b({names})\b", r"elastic_\1", text)
    return polynomials | {"SLOPED": "elastic.elastic_tangent", "ELASTIC": nested}


LANGUAGES = {
    "modelica-law": Language(
        template=TEMPLATE,
        mark="//",
        usage=(
            "A Modelica package: p = {name}.pressure(c), with its derivative; where p is known "
            "a tool solves this for c. Outside the range an assertion fails."
        ),
        call="{name}.{what}({x})",
        law_places=_law_places,
        number=_notation.number,
        # of an assertion: Modelica has no NaN
        unknown="c < {}",
        none="true",
        reserved=_reserved,
        # tools solve for c themselves
        inverts=False,
    )
}
