"""User subroutines of solvers in C: a law in the shape that a solver calls."""

from collections.abc import Mapping

from mbma_tables.export.code.core_code import c_language
from mbma_tables.export.code.language import Language

LAST_VALUE = (
    "At pressures beyond the law's range the last value is used, with one warning on "
    "stderr."
)
# of a solver's surface interactions, by the names of its routine
_INTERACTIONS = (
    "Surface interactions of other names stop the job. Several laws in one job, each exported "
    "under a name of its own: begin a file with the line #define {routine}_INTERFACES "
    'INTERFACE("{{interface}}", {{name}}) INTERFACE("SEAL", seal) and go on with the contents '
    "of {{name}}.c and seal.c, or #include both; the text in quotes is the name of the "
    "surface interaction, the other one that of the law."
)


def several_laws(routine: str) -> str:
    """How several laws are used in one job, for the user of a routine."""
    return _INTERACTIONS.format(routine=routine.upper())


def subroutine(
    routine: str,
    usage: str,
    parts: Mapping[str, str],
    conductance_alone: bool = False,
    friction: tuple[str, str] | None = None,
    **texts: str,
) -> Language:
    """The C of a law with a routine, whose template is subroutines/ROUTINE.c; `texts` are those of the documentation."""
    return c_language(
        usage,
        # of Abaqus, and of Abaqus/Explicit
        of_solver="void xit_(void) {}\nvoid xplb_exit_(void) {}\n",
        parts=parts,
        subroutine=routine,
        conductance_alone=conductance_alone,
        friction=friction,
        **texts,
    )
