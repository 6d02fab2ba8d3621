"""Laws in C: the core's code, and the law's numbers as data."""

import functools

from mbma_tables.export.code.core_code import core_places
from mbma_tables.export.code.language import NAN, Beside, Language
from mbma_tables.export.text import number

LANGUAGES = {
    "c-law": Language(
        template="code/languages/law.c",
        mark="/*",
        usage=(
            "C99, also C++11: cc -O2 -c {name}.c, link with -lm; {name}.h beside it declares "
            "the functions. The C of the library itself, and the law's own numbers. "
            f"{NAN}"
        ),
        call="{name}_{what}({x})",
        law_places=core_places,
        number=functools.partial(number, infinity="INFINITY"),
        beside=(Beside(".h", "code/languages/law.h"),),
    )
}
