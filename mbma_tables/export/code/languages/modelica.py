"""Laws in Modelica: a package with the law's functions, and their derivatives."""

import functools
import re
from typing import Any

from mbma_tables.export.code.language import (
    FOLDER,
    AskedLaw,
    Language,
    Program,
    evaluator,
)
from mbma_tables.export.code.polynomials import braces
from mbma_tables.export.reserved_words import small_words, words_of_code
from mbma_tables.export.text import number, template

TEMPLATE = "law.mo"
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
# a power of a unit, such as mm^3, which Modelica has as mm3
_POWER = re.compile(r"([A-Za-z]+)\^(\d)")


def _reserved() -> frozenset[str]:
    """Words that name no package with a law."""
    text = template(f"{FOLDER}/{TEMPLATE}") + _functions()
    return small_words(KEYWORDS, "elastic", words_of_code(text, "//"))


def _functions() -> str:
    """The functions of the evaluator, without the package that they are in."""
    return "\n".join(evaluator(TEMPLATE).splitlines()[1:-1])


def _places(asked: AskedLaw) -> dict[str, Any]:
    """Functions, and units of powers."""
    units = {}
    for name, function in asked.functions.items():
        power = _POWER.fullmatch(function.unit)
        units[name] = "".join(power.groups()) if power else ""
    return {"evaluator": _functions(), "units": units}


CHECK = """
import pathlib, rumoca
found = rumoca.validate_source(pathlib.Path("{file}").read_text())
errors = [str(one) for one in found if one.level == "error"]
raise SystemExit("".join(errors) or None)
"""
PROGRAM = Program(
    "ask.py",
    """\
import pathlib

import numpy as np
import rumoca

MODEL = '''
package asked
  constant Real gaps[SIZE] = { GAPS };
  function at
    input Real time_;
    output Real c;
  protected
    Integer k;
  algorithm
    k := integer(floor(time_ + 1.5));
    c := gaps[k];
  end at;
end asked;
model Ask
  Real c;
{% for _ in asked %}
  Real y{{ loop.index }};
{% endfor %}
equation
  c = asked.at(time);
{% for law, function in asked %}
  y{{ loop.index }} = {{ law }}.{{ function }}(c);
{% endfor %}
end Ask;
'''
c = np.loadtxt("c.txt", ndmin=1)
gaps = ", ".join(map(repr, c.tolist()))
model = MODEL.replace("SIZE", str(c.size)).replace("GAPS", gaps)
# in a folder of its own: rumoca reads all files beside one
both = pathlib.Path("both", "both.mo")
both.parent.mkdir()
laws = [pathlib.Path(f"{name}.mo").read_text() for name in "{{ laws | join(" ") }}".split()]
both.write_text("".join(laws) + model)
found = rumoca.Session().load(str(both), model="Ask").simulate(t=(0, c.size - 1), dt=1)
assert (np.asarray(found["c"]) == c).all()
columns = [found[f"y{k + 1}"] for k in range({{ asked | length }})]
np.savetxt("values.txt", np.transpose(columns), "%.17g")
""",
    ("python ask.py",),
    ".mo",
    ("rumoca",),
)


LANGUAGES = {
    "modelica-law": Language(
        template=TEMPLATE,
        evaluator=TEMPLATE,
        check=("python", "-c", CHECK),
        mark="//",
        usage=(
            "A Modelica package: p = {name}.pressure(c), with its derivative; where p is known "
            "a tool solves this for c. Outside the range an assertion fails."
        ),
        call="{name}.{what}({x})",
        program=PROGRAM,
        number=functools.partial(number, infinity="1.0e300", missing="0.0"),
        array=braces,
        places=_places,
        reserved=_reserved,
        # tools solve for c themselves
        inverts=False,
        output=(
            "a package: pressure and energy with their derivatives, tangent, area, with"
            " units; the inverse is computed by the Modelica tool"
        ),
        outside="an assertion that fails",
        tested=(
            "rumoca 0.10: compiled and simulated, within 1e-9 at 10,000 gaps of two laws"
        ),
    )
}
