"""Laws of the core as C in one file: its code, and the numbers of laws as data."""

import functools
import re
import zlib
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.contacts.law import block as at
from mbma_tables.export.code.language import (
    AskedLaw,
    Language,
    Program,
    evaluator,
)
from mbma_tables.export.text import (
    braces,
    core_file,
    number,
    numerals,
    template,
    wrapped,
)

DATA = """\
static const struct {{
    mbma_law_head head;
    mbma_law_row rows[{rows}];
    mbma_law_record records[{records}];
}} {name}_DATA = {{
{data}
}};
static const mbma_law {name} = {{&{name}_DATA.head, {name}_DATA.rows, {name}_DATA.records, \
{records} - 1}};
"""
# a command that finds errors in the evaluator of C
CHECK = (
    *("gcc", "-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"),
    *("-fsyntax-only", "{file}"),
)
# prints functions of laws at overclosures, for tests
PROGRAM = """\
#include <stdio.h>
{% for law, function in asked %}
double {{ law }}_{{ function }}(double c);
{% endfor %}
int main(void) {
    FILE *in = fopen("c.txt", "r"), *out = fopen("values.txt", "w");
    double c;
    while (fscanf(in, "%lf", &c) == 1) {
{% for law, function in asked %}
        fprintf(out, "%.17g ", {{ law }}_{{ function }}(c));
{% endfor %}
        fprintf(out, "\\n");
    }
    return fclose(in) + fclose(out);
}
"""
# functions that other files see, where they are made
_DEFINED = re.compile(
    r"^(?!static|typedef|MBMA_INLINE)\w[\w *]*\b(mbma_\w+)\([^{;]*\{$", re.M
)


def c_language(usage: str, of_solver: str = "", **options: Any) -> Language:
    """A language whose file is the core's C with a law's numbers.

    `of_solver` has what the solver defines that calls it, for the program of tests.
    """
    return Language(
        template="law.c",
        evaluator="law.c",
        check=CHECK,
        mark="/*",
        usage=usage,
        call="{name}_{what}({x})",
        program=Program(
            "ask.c",
            PROGRAM + of_solver,
            (
                "gcc -std=c99 -O1{% for law in laws %} {{ law }}.c{% endfor %} ask.c -lm -o ask",
                "./ask",
            ),
            ".c",
        ),
        number=functools.partial(number, infinity="INFINITY", missing="(double)NAN"),
        places=core_places,
        **options,
    )


def blocks_of(asked: AskedLaw) -> dict[str, FloatArray]:
    """Blocks of the laws and curves of a file, by name."""
    blocks = {name: law.block for name, law in asked.laws.items()}
    return blocks | {f"{name}_curve": curve.block for name, curve in asked.curves.items()}


def core_places(asked: AskedLaw) -> dict[str, Any]:
    """Places of the template of C: the core's code, and the law's blocks as data."""
    data = []
    for name, block in blocks_of(asked).items():
        variable = name.upper() if name in asked.laws else f"{name[:-6]}_CURVE"
        data.append(_data(f"{asked.name}_{variable}", block))
    return {
        "core": core_text(asked.name),
        "code_mark": _code_mark(),
        "data": "".join(data).rstrip(),
    }


def core_text(prefix: str) -> str:
    """Laws of the core with their headers.

    A prefix to the functions lets a program hold several laws.
    """
    texts = [core_file(name) for name in ("mbma.h", "elementary.h", "law.c")]
    lines = ["/* functions of the core, which this file holds, under names of its own */"]
    for text in texts:
        names = _DEFINED.findall(text)
        lines.extend(f"#define {name} {prefix}_{name}" for name in names)
    texts.append(evaluator("law.c"))
    lines.extend(re.sub(r'^#include ".*"\n', "", text, flags=re.M) for text in texts)
    return "\n".join(lines)


@functools.cache
def _code_mark() -> str:
    """A number of all code that laws in one file share, where other code is refused."""
    code = core_text("")
    names = ("interfaces", "friction", "uinter", "vuinter", "gapcon")
    for name in ("languages/law", *(f"subroutines/{name}" for name in names)):
        code += template(f"code/{name}.c")
    return f"0x{zlib.crc32(code.encode()):08x}"


def _data(name: str, block: FloatArray) -> str:
    """A law's block as the head, rows and records of a variable in C, every number as it is."""
    # indices, shifts and bases are integers in words of the same size
    words = block.view(np.int64)
    first_record = int(words[at.RECORDS])
    head = braces(
        *numerals(block[: at.EXPONENT]), *numerals(words[at.EXPONENT : at.HEAD])
    )
    rows = words[at.HEAD : first_record].reshape(-1, 2)
    records = []
    for record in block[first_record:].reshape(-1, at.RECORD):
        force, area = np.split(record[at.FORCE_AT : -1], 2)
        centre_and_rate = numerals(record[: at.FORCE_AT])
        records.append(braces(*centre_and_rate, force, area, *numerals(record[-1])))
    parts = (head, braces(*rows), braces(*records))
    data = ",\n".join(wrapped(part) for part in parts)
    return DATA.format(name=name, data=data, rows=len(rows), records=len(records))
