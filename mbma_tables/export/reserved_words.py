"""Names that a language cannot give to a module, a package or a function; all in small letters."""

import keyword
import re
import sys
from collections.abc import Iterable

from mbma_tables.export.text import template

WORD = re.compile(r"(?<![@\w])[A-Za-z]\w*(?![@\w])")

# of MATLAB and of Octave
MATLAB_KEYWORDS = """
    arguments break case catch classdef continue do else elseif end end_try_catch
    end_unwind_protect endarguments endclassdef endenumeration endevents endfor endfunction endif
    endmethods endparfor endproperties endspmd endswitch endwhile enumeration events for function
    global if import methods otherwise parfor persistent properties return spmd switch try until
    unwind_protect unwind_protect_cleanup while
"""
# Modelica 3.6, sections 2.3.3, 3.7 and 4.9: key words, functions and types that are always there
MODELICA_KEYWORDS = """
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
# names of the module itself; the key words of Fortran are not reserved
FORTRAN_NAMES = "dp h_max least_overclosure largest_overclosure"
# modules that a module of the same name would hide from numpy and jax
PYTHON_PACKAGES = "numpy jax jaxlib scipy ml_dtypes opt_einsum"
# no file of Windows may have these names, whatever its ending
WINDOWS_DEVICES = "con prn aux nul " + " ".join(
    f"{device}{number}" for device in ("com", "lpt") for number in range(1, 10)
)


def small_words(*texts: str) -> frozenset[str]:
    """The words of texts, in small letters."""
    return frozenset(word.lower() for text in texts for word in text.split())


def words_of_code(text: str, mark: str) -> str:
    """Names and key words of source code, without comments, texts and the places of a template."""
    code = re.sub(rf"{mark}.*|\"[^\"\n]*\"|(?<!\w)'[^'\n]*'|\{{\w+\}}", " ", text)
    return " ".join(WORD.findall(code))


def matlab_words(text: str) -> frozenset[str]:
    """Words that name no function whose file has this text, in MATLAB or Octave."""
    return small_words(MATLAB_KEYWORDS, words_of_code(text, "%"))


def fortran_words(functions: Iterable[str]) -> frozenset[str]:
    """Words that name no module with these functions in Fortran."""
    return small_words(FORTRAN_NAMES, *(f"c_{function}" for function in functions))


def python_words() -> frozenset[str]:
    """Words that name no module which imports numpy or jax."""
    return small_words(*keyword.kwlist, *sys.stdlib_module_names, PYTHON_PACKAGES)


def modelica_words() -> frozenset[str]:
    """Words that name no package with a law in Modelica."""
    return small_words(
        MODELICA_KEYWORDS, "elastic", words_of_code(template("law.mo"), "//")
    )


def law_in_matlab_words() -> frozenset[str]:
    """Words that name no function with a law in MATLAB."""
    return matlab_words(template("law.m"))


def windows_words() -> frozenset[str]:
    """Words that name no file of Windows."""
    return small_words(WINDOWS_DEVICES)
