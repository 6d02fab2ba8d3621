"""Contact laws in the formats of other programs: a file a program, each with a `Grammar` of rows.

CalculiX 2.20 and GetDP 3.2 were run. The others follow manuals and sources, which their
files name.
"""

from mbma_tables.export.rows.solvers.abaqus import abaqus as abaqus
from mbma_tables.export.rows.solvers.calculix import calculix as calculix
from mbma_tables.export.rows.solvers.comsol import comsol as comsol
from mbma_tables.export.rows.solvers.geos import geos as geos
from mbma_tables.export.rows.solvers.getdp import getdp as getdp
from mbma_tables.export.rows.solvers.lethe import lethe as lethe
from mbma_tables.export.rows.solvers.lsdyna import lsdyna as lsdyna
from mbma_tables.export.rows.solvers.mbdyn import mbdyn as mbdyn
from mbma_tables.export.rows.solvers.modelica import modelica as modelica
from mbma_tables.export.rows.solvers.moose import moose as moose
from mbma_tables.export.rows.solvers.moose import moose_function as moose_function
from mbma_tables.export.rows.solvers.optistruct import optistruct as optistruct

# by the names of their targets, in the order in which help lists them
SOLVERS = {
    "calculix": calculix,
    "abaqus": abaqus,
    "lsdyna": lsdyna,
    "optistruct": optistruct,
    "comsol": comsol,
    "moose": moose,
    "modelica": modelica,
    "mbdyn": mbdyn,
    "geos": geos,
    "moose-function": moose_function,
    "getdp": getdp,
    "lethe": lethe,
}
TARGETS = tuple(grammar.target(name) for name, grammar in SOLVERS.items())
