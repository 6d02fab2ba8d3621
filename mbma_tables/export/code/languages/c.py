"""Laws in C: the core's code, and the law's numbers as data."""

import functools

from mbma_tables.export.code.core_code import CHECK, core_places
from mbma_tables.export.code.language import NAN, Beside, Language, Program
from mbma_tables.export.text import number

PROGRAM = Program(
    "ask.c",
    """\
#include <stdio.h>
{% for function in functions %}
double {{ name }}_{{ function }}(double c);
{% endfor %}
int main(void) {
    FILE *in = fopen("c.txt", "r"), *out = fopen("values.txt", "w");
    double c;
    while (fscanf(in, "%lf", &c) == 1) {
{% for function in functions %}
        fprintf(out, "%.17g ", {{ name }}_{{ function }}(c));
{% endfor %}
        fprintf(out, "\\n");
    }
    return fclose(in) + fclose(out);
}
""",
    ("gcc -std=c99 -O1 road.c ask.c -lm -o ask", "./ask"),
    ".c",
)

LANGUAGES = {
    "c-law": Language(
        template="law.c",
        evaluator="law.c",
        check=CHECK,
        mark="/*",
        usage=(
            "C99, also C++11: cc -O2 -c {name}.c, link with -lm; {name}.h beside it declares "
            "the functions. The C of the library itself, and the law's own numbers. "
            f"{NAN}"
        ),
        call="{name}_{what}({x})",
        program=PROGRAM,
        number=functools.partial(number, infinity="INFINITY", missing="(double)NAN"),
        places=core_places,
        beside=(Beside(".h", "law.h"),),
    )
}
