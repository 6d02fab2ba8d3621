"""Contact laws as matrices for the tables of Modelica's standard library, `CombiTable1Ds`."""

from mbma_tables.export.law_table import LawTable
from mbma_tables.export.rows.solvers.comsol import columns
from mbma_tables.export.targets import Grammar


def _matrix(law: LawTable, name: str) -> str:
    return f"double {name}({law.x.size},{len(law.columns)})\n{columns(law)}"


modelica = Grammar(
    program="Modelica",
    mark="#",
    of_any=_matrix,
    beyond=(
        "smoothness = Modelica.Blocks.Types.Smoothness.LinearSegments; no extrapolation"
    ),
    named="law",
    first="#1\n",
)
