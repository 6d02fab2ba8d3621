"""Laws as a user subroutine of CalculiX: GAPCON."""

from mbma_tables.export.code.subroutine import LAST_VALUE, several_laws, subroutine

LANGUAGES = {
    "calculix-gapcon": subroutine(
        "gapcon",
        usage=(
            "*GAP CONDUCTANCE, USER of *SURFACE INTERACTION, NAME={interface}, in place of "
            "CalculiX's gapcon.f: in its sources cc -O2 -c {name}.c -o gapcon.o, ar r "
            "ccx_2.20.a gapcon.o, and make, which links ccx again. Use it with *CONTACT PAIR, "
            "TYPE=SURFACE TO SURFACE and *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL "
            "or LINEAR: with NODE TO SURFACE 2.20 hands over another pressure, without a "
            "message, and with TABULAR it has no force. EXPONENTIAL, which `mbma export "
            "calculix --conductivity` fits to this law, gives closure and conductance in one "
            f"interaction. {several_laws('gapcon')} {LAST_VALUE} "
            "{name}.c is C99, also C++11. Run in ccx 2.20. Arguments: CalculiX 2.7 to 2.20, "
            "gapcon.f."
        ),
        # its own routines end the job by an exit status
        parts={
            "solver": "CalculiX",
            "stop_declared": "",
            "stop": "exit(201) /* as CalculiX's own routines do */",
        },
        conductance_alone=True,
        output=(
            "`GAPCON` in C, likewise: conductance against the pressure in the solver, "
            "and its derivative; beyond the range the last value"
        ),
        outside="keeps the last value, with a warning",
        tested=(
            "called by a Fortran program with the argument lists of the manuals of "
            "CalculiX (2.7 to 2.20); linked into CalculiX 2.20, with EXPONENTIAL and "
            "surface-to-surface contact: within 1e-3 of the conductance at the pressure"
            " reached, at 6 pressures of two laws"
        ),
    )
}
