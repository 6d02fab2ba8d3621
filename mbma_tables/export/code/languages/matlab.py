"""Laws in MATLAB and Octave."""

import functools

from mbma_tables.export.code.language import FOLDER, Language, Program, evaluator
from mbma_tables.export.code.polynomials import matrix
from mbma_tables.export.reserved_words import matlab_words
from mbma_tables.export.text import number, template

TEMPLATE = "law.m"


def _reserved() -> frozenset[str]:
    """Words that name no function with a law."""
    return matlab_words(template(f"{FOLDER}/{TEMPLATE}") + evaluator(TEMPLATE))


PROGRAM = Program(
    "ask.m",
    """\
{% for law in laws %}
of_{{ law }} = {{ law }}();
{% endfor %}
c = load('c.txt'); values = [];
{% for law, function in asked %}
values(:, end + 1) = of_{{ law }}.{{ function }}(c(:));
{% endfor %}
file = fopen('values.txt', 'w');
fprintf(file, [repmat('%.17g ', 1, size(values, 2)), '\\n'], values'); fclose(file);
""",
    ("octave-cli --no-init-file ask.m",),
    ".m",
)


LANGUAGES = {
    "matlab-law": Language(
        template=TEMPLATE,
        evaluator=TEMPLATE,
        check=("octave-cli", "--no-init-file", "--eval", "__parse_file__('{file}')"),
        mark="%",
        usage=(
            "MATLAB and Octave: law = {name}(); arrays of any shape. Outside the range: an "
            "error."
        ),
        call="law.{what}({x})",
        program=PROGRAM,
        number=functools.partial(number, infinity="Inf", missing="NaN"),
        array=matrix,
        reserved=_reserved,
        output="a function that returns a structure of functions",
        outside="an error",
        tested="Octave 7.3: the same; not in MATLAB",
    )
}
