"""Force and area from a table of one's own: of one island, and of a rough surface.

Run it with the file that `mbma tables make universal --target 1e-6 --out mine.nc` writes:
`python examples/own_table.py mine.nc`.
"""

import sys

from mbma_tables import Surface, contact, open_table
from mbma_tables.theories import Mbma

path = sys.argv[1]
force, area, error = open_table(path).answer(2.0, 0.1)  # X and mu, numbers or arrays
print(f"island: Phi_F {force:.6f}, Phi_A {area:.6f}, within {error:.1e}")

road = Surface.named("concrete")
pressed = contact(road, "13.3 MPa", separation="0.2 mm", theory=Mbma(island_model=path))
print(
    f"concrete: {pressed.pressure:.5f} MPa on {pressed.area:.4%} of the area, "
    f"within {pressed.error:.1e}"
)
