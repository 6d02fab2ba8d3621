"""Laws as user subroutines of Abaqus: UINTER and GAPCON of Standard, VUINTER of Explicit."""

from mbma_tables.export.code.subroutine import LAST_VALUE, several_laws, subroutine

CALLED = (
    "{name}.c is C99, also C++11. Written from the manual's list of arguments and called with "
    "it by a program of the tests; not run in Abaqus."
)
# Abaqus has a routine that ends the job
STOP = {
    "stop_declared": (
        "SUBROUTINE FOR_NAME(xit, XIT)(void); /* of Abaqus, closes its files */"
    ),
    "stop": "FOR_NAME(xit, XIT)()",
}
STOP_EXPLICIT = {
    "stop_declared": "SUBROUTINE FOR_NAME(xplb_exit, XPLB_EXIT)(void); /* of Abaqus */",
    "stop": "FOR_NAME(xplb_exit, XPLB_EXIT)()",
}

LANGUAGES = {
    "abaqus-uinter": subroutine(
        "uinter",
        usage=(
            "{friction} *SURFACE INTERACTION, NAME={interface}, USER: abaqus job=... "
            "user={name}.c. "
            f"{several_laws('uinter')} "
            "Place the bodies so that their surfaces touch where the mean planes are h_max "
            "apart. Beyond the law's range the increment is tried again with a smaller step. A "
            "linear perturbation step stops the program: for modes of a preloaded joint take "
            "the tangent at its pressure, from this file, as a spring's stiffness. "
            f"{CALLED} Arguments: Abaqus 2017, user subroutines, UINTER."
        ),
        parts=STOP,
        friction=(
            "WITHOUT FRICTION: the faces slide freely.",
            "WITH FRICTION, whose tangent is not symmetric where the faces slip: add UNSYMM "
            "to *SURFACE INTERACTION, without which Abaqus takes the symmetric part. Shear "
            "stresses are in the local directions as Abaqus hands them over, DROT is not used.",
        ),
        output=(
            "`UINTER` in C, in one file with the law: pressure, shear with Coulomb's "
            "friction, tangent, energies, heat flux and its derivatives"
        ),
        outside="asks for a smaller increment",
        tested=(
            "called by a Fortran program with the argument list of the manual (2017), "
            "warnings as errors, which iterates as Abaqus does: paths of stick and slip"
            " in one and two directions against an integration of its own, tangents "
            "against differences, Newton's method quadratic in slip; not in Abaqus"
        ),
    ),
    "abaqus-vuinter": subroutine(
        "vuinter",
        usage=(
            "{friction} *SURFACE INTERACTION, NAME={interface}, USER of a *CONTACT PAIR: "
            "abaqus job=... double=both user={name}.c, since all numbers are of double "
            f"precision. {several_laws('vuinter')} "
            "Place the bodies so that their surfaces touch where the mean planes are h_max "
            "apart. Without heat. The law's tangent is a stiffness that the time increment "
            f"must resolve, which Abaqus does not know. {LAST_VALUE} {CALLED} "
            "Arguments: Abaqus 2017, user subroutines, VUINTER."
        ),
        parts=STOP_EXPLICIT,
        friction=(
            "WITHOUT FRICTION: the faces slide freely.",
            "WITH FRICTION. Shear stresses are in the local directions as Abaqus hands them "
            "over, DROT is not used; SFD is what slip dissipates in the increment.",
        ),
        output=(
            "`VUINTER` in C for Abaqus/Explicit, likewise, for all nodes of a contact "
            "pair: pressure, shear with friction, energies; without heat"
        ),
        outside="keeps the last value, with a warning",
        tested=(
            "called by a Fortran program with the argument list of the manual (2017): "
            "paths of several nodes against an integration of its own; not in Abaqus"
        ),
    ),
    "abaqus-gapcon": subroutine(
        "gapcon",
        usage=(
            "*GAP CONDUCTANCE, USER of *SURFACE INTERACTION, NAME={interface}: abaqus job=... "
            "user={name}.c, beside a table of pressures. "
            f"{several_laws('gapcon')} {LAST_VALUE} {CALLED} "
            "Arguments: Abaqus 6.5 to 2017, user subroutines, GAPCON."
        ),
        parts={"solver": "Abaqus/Standard", **STOP},
        conductance_alone=True,
        output=(
            "`GAPCON` in C, likewise: conductance against the pressure in the solver, "
            "and its derivative; beyond the range the last value"
        ),
        outside="keeps the last value, with a warning",
        tested=(
            "called by a Fortran program with the argument lists of the manuals of "
            "Abaqus (6.5 to 2017); not in Abaqus"
        ),
    ),
}
