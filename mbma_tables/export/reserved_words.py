"""Names that a language cannot give to a module, a package or a function; all in small letters."""

import re

# no fields of structures
WORD = re.compile(r"(?<![\w.])[A-Za-z]\w*")
# tags of a template, and its places with the names that they are parts of
_OF_TEMPLATES = r"\{%.*?%\}|\w*\{\{.*?\}\}\w*"

# of MATLAB and of Octave
MATLAB_KEYWORDS = """
    arguments break case catch classdef continue do else elseif end end_try_catch
    end_unwind_protect endarguments endclassdef endenumeration endevents endfor endfunction endif
    endmethods endparfor endproperties endspmd endswitch endwhile enumeration events for function
    global if import methods otherwise parfor persistent properties return spmd switch try until
    unwind_protect unwind_protect_cleanup while
"""
# no file of Windows may have these names, whatever its ending
WINDOWS_DEVICES = "con prn aux nul " + " ".join(
    f"{device}{number}" for device in ("com", "lpt") for number in range(1, 10)
)


def small_words(*texts: str) -> frozenset[str]:
    """The words of texts, in small letters."""
    return frozenset(word.lower() for text in texts for word in text.split())


def words_of_code(text: str, mark: str) -> str:
    """Names and key words of source code, without comments, texts and the places of a template."""
    plain = re.sub(_OF_TEMPLATES, " ", text)
    code = re.sub(rf"{mark}.*|\"[^\"\n]*\"|(?<!\w)'[^'\n]*'", " ", plain)
    return " ".join(WORD.findall(code))


def matlab_words(text: str) -> frozenset[str]:
    """Words that name no function whose file has this text, in MATLAB or Octave."""
    return small_words(MATLAB_KEYWORDS, words_of_code(text, "%"))


def windows_words() -> frozenset[str]:
    """Words that name no file of Windows."""
    return small_words(WINDOWS_DEVICES)
