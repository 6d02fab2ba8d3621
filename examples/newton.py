"""A block that stands on a rough plane, pressed by an uneven traction: Newton's method in scikit-fem, from zero load.

    pip install scikit-fem
    python examples/newton.py

Nothing but the contact holds the block. At the beginning the bodies just touch, and the law
has no stiffness there; `law.continued()` has, and answers trial steps beyond full
compression. The solution is one of the law itself.
"""

import click
import numpy as np
from skfem import (
    Basis,
    BilinearForm,
    ElementQuad2,
    ElementVector,
    LinearForm,
    MeshQuad,
    condense,
    solve,
)
from skfem.models.elasticity import lame_parameters, linear_elasticity

from mbma_tables import Surface, contact_law

# mm, MPa
WIDTH = 40.0
HEIGHT = 20.0
E = 200.0
NU = 0.3
law = contact_law(Surface.named("concrete"), "13.3 MPa", theory="calibrated")  # mm, MPa
trial = law.continued()


@LinearForm
def traction(v, w):
    """Between 0.1 and 0.3 MPa on the top."""
    return -(0.1 + 0.2 * w.x[0] / WIDTH) * v[1]


@LinearForm
def contact_force(v, w):
    """Pressure on the bottom, upwards."""
    return w.pressure * v[1]


@BilinearForm
def contact_stiffness(u, v, w):
    """Of that force, which falls as the bottom rises."""
    return w.stiffness * u[1] * v[1]


mesh = MeshQuad.init_tensor(
    np.linspace(0, WIDTH, 17), np.linspace(0, HEIGHT, 9)
).with_defaults()
basis = Basis(mesh, ElementVector(ElementQuad2()))
bottom = basis.boundary("bottom")
elastic = linear_elasticity(*lame_parameters(E, NU)).assemble(basis)
load = traction.assemble(basis.boundary("top"))
held = basis.get_dofs(lambda x: (x[0] == WIDTH / 2) & (x[1] == HEIGHT)).all(
    "u^1"
)  # sideways, at one node

moved = basis.zeros()
for turn in range(40):
    separation = law.h_max + bottom.interpolate(moved)[1]
    pressure, stiffness = trial.pressure_and_stiffness(separation)
    residual = load + contact_force.assemble(bottom, pressure=pressure) - elastic @ moved
    residual[held] = 0.0
    click.echo(
        f"{turn:2d} {np.abs(residual).max():.1e} {int((~trial.inside(separation)).sum()):3d} points beyond the law"
    )
    if np.abs(residual).max() < 1e-12:
        break
    tangent = elastic + contact_stiffness.assemble(bottom, stiffness=stiffness)
    moved = moved + solve(*condense(tangent, residual, D=held))
assert trial.inside(separation).all()
force = float((law.pressure(separation) * bottom.dx).sum())
click.echo(
    f"force {force:.9f} N/mm of {0.2 * WIDTH:.9f}, pressure {pressure.min():.3f} to {pressure.max():.3f} MPa"
)
