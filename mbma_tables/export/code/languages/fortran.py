"""Laws in Fortran: a module of elemental functions, on top of the C of the law."""

import functools
from typing import Any

from mbma_tables.contacts.quantities.registry import registry
from mbma_tables.export.code.language import (
    FUNCTIONS,
    NAN,
    AskedLaw,
    Beside,
    Language,
    Program,
)
from mbma_tables.export.reserved_words import small_words
from mbma_tables.export.text import number

# names of the module itself; the key words of Fortran are not reserved
NAMES = "dp h_max least_overclosure largest_overclosure"


def _reserved() -> frozenset[str]:
    """Words that name no module with these functions."""
    return small_words(
        NAMES, *(f"c_{function}" for function in (*FUNCTIONS, *registry()))
    )


def _places(asked: AskedLaw) -> dict[str, Any]:
    """Functions of the module, all alike but `with_tangent`, which is a subroutine."""
    public = [*FUNCTIONS, *asked.functions]
    elemental = [function for function in public if function != "with_tangent"]
    # a line each: a line has 132 letters at most
    return {"public": ", &\n    ".join(public), "elemental": elemental}


PROGRAM = Program(
    "ask.f90",
    """\
program ask
  use, intrinsic :: iso_fortran_env, only: dp => real64
{% for law, function in asked %}
  use {{ law }}, only: {{ law }}_{{ function }} => {{ function }}
{% endfor %}
  implicit none
  real(dp) :: c
  integer :: status
  open (10, file="c.txt")
  open (11, file="values.txt")
  do
    read (10, *, iostat=status) c
    if (status /= 0) exit
{% for law, function in asked %}
    write (11, "(es25.16e3)", advance="no") {{ law }}_{{ function }}(c)
{% endfor %}
    write (11, *)
  end do
end program
""",
    (
        "gcc -std=c99 -O1 -c{% for law in laws %} {{ law }}_c.c{% endfor %}",
        "gfortran -std=f2008 -Wall -Wextra -Wpedantic -Werror -fcheck=all -O1"
        "{% for law in laws %} {{ law }}_c.o {{ law }}.f90{% endfor %} ask.f90 -o ask",
        "./ask",
    ),
    ".f90",
)


LANGUAGES = {
    "fortran-law": Language(
        template="law.f90",
        mark="!",
        usage=(
            "Fortran 2008 on top of {name}_c.c, which is written beside it, by `mbma export "
            "c-law`: cc -O2 -c {name}_c.c, gfortran -c {name}.f90, then use {name}; functions "
            f"are elemental, of real(c_double). {NAN}"
        ),
        call="{what}({x})",
        program=PROGRAM,
        number=functools.partial(number, exponent="d", infinity="huge(1d0)"),
        places=_places,
        # the C that the module calls is beside it
        beside=(Beside("_c.c", target="c-law"),),
        alone=False,
        reserved=_reserved,
        output=(
            "a Fortran 2008 module of elemental functions, and `NAME_c.c` beside it, "
            "the same C"
        ),
        outside="NaN",
        tested=(
            "gfortran 12.2, `-std=f2008 -fcheck=all`, warnings as errors: the same "
            "gaps, three laws"
        ),
    )
}
