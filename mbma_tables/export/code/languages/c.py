"""Laws in C: the core's code, and the law's numbers as data."""

from mbma_tables.export.code.core_code import c_language
from mbma_tables.export.code.language import NAN, Beside

LANGUAGES = {
    "c-law": c_language(
        "C99, also C++11: cc -O2 -c {name}.c, link with -lm; {name}.h beside it declares "
        "the functions. The C of the library itself, and the law's own numbers. "
        f"{NAN}",
        beside=(Beside(".h", "law.h"),),
    )
}
