"""Contacts and joints as functions with derivatives: for scipy, JAX and PyTorch, against contacts described anew."""

import numpy as np
import pytest
from helpers import difference_weights, refusals
from scipy.optimize import check_grad, minimize

from mbma_tables import (
    Bodies,
    Joint,
    OutOfRangeError,
    Surface,
    contact,
    contact_function,
)

FACE = {"Ra": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
METALS = ("steel 4140 hard", "aluminium 6061 hard")
OFFSETS = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
WEIGHTS = difference_weights(OFFSETS)
GROUND = {"hurst": 0.8, "Rq": 0.5, "Rdq": 0.1, "longest": 100.0, "h_max": 1.8}
NUMBERS = ["Rq", "Rdq", "E_star", "pressure"]
QUANTITIES = ["area", "mean_separation"]


def ground_function(quantities=QUANTITIES, **changed):
    surface = Surface.from_roughness(**GROUND | changed, unit="um")
    given = {"pressure": "10 MPa", "theory": "calibrated"}
    return contact_function(
        surface, "100 GPa", quantities=quantities, numbers=NUMBERS, **given
    )


def ground_contact(x):
    """The quantities of a contact that is described anew."""
    Rq, Rdq, E_star, pressure = x
    surface = Surface.from_roughness(**GROUND | {"Rq": Rq, "Rdq": Rdq}, unit="um")
    pressed = contact(
        surface,
        f"{float(E_star)!r} GPa",
        pressure=f"{float(pressure)!r} GPa",
        theory="calibrated",
    )
    return np.array([pressed.area, pressed.mean_separation])


def differences(ask, x, step=4e-4):
    """The Jacobian of values described anew."""
    columns = []
    for k, number in enumerate(x):
        moved = [
            ask([*x[:k], number * (1 + step * offset), *x[k + 1 :]]) for offset in OFFSETS
        ]
        columns.append(np.tensordot(WEIGHTS, np.array(moved), 1) / (step * number))
    return np.stack(columns, axis=-1)


def assert_close(jacobian, expected, values, x):
    apart = np.abs(jacobian - expected)
    size = np.abs(np.asarray(values)[..., None] / np.asarray(x))
    assert (apart <= 1e-6 * np.maximum(size, np.abs(expected))).all()


def test_values_and_jacobian_of_a_batch():
    function = ground_function()
    np.testing.assert_allclose(function.start, [0.5, 0.1, 100.0, 0.01], rtol=1e-14)
    x = np.array([[[0.5, 0.1, 100.0, 0.01], [0.4, 0.12, 90.0, 0.02]]])
    values, jacobian = function.values_and_jacobian(x)
    assert values.shape == (1, 2, 2)
    assert jacobian.shape == (1, 2, 2, 4)
    for k in range(2):
        np.testing.assert_allclose(values[0, k], ground_contact(x[0, k]), rtol=1e-12)
        expected = differences(ground_contact, list(x[0, k]))
        assert_close(jacobian[0, k], expected, values[0, k], x[0, k])
    one = ground_function("area")
    np.testing.assert_array_equal(one(x), values[..., 0])
    np.testing.assert_array_equal(one.jacobian(x), jacobian[..., 0, :])
    assert "Rdq" in str(function.sensitivity(x[0, 0]))


@pytest.mark.parametrize("numbers", [["part_a.hurst", "part_b.Ra", "pressure"], ["part_b.E", "part_a.nu"]], ids=str)  # fmt: skip
def test_a_joint_of_two_faces(numbers):
    """Whose surfaces are made one by one; moduli and Poisson's ratios reach the tangential stiffness, too."""
    quantities = ["total_conductance", "tangential_stiffness"]
    rougher = FACE | {"Ra": "0.6 um", "longest": "800 um"}
    joint = Joint(FACE, rougher, bodies=METALS, nominal_area="4 cm^2")
    function = joint.function(quantities, numbers, "10 MPa")
    x = np.array([function.start, 1.01 * function.start])
    values, jacobian = function.values_and_jacobian(x)
    at_start = joint.at_pressure("10 MPa")
    known = [at_start.total_conductance, at_start.tangential_stiffness]
    np.testing.assert_allclose(values[0], known, rtol=1e-6)
    np.testing.assert_allclose(values[0], function(x[0]), rtol=1e-13)

    def anew(x):
        """The quantities of joints of rows, or of one."""
        rows = np.atleast_2d(x)
        # the spectra of two faces of a batch are added as they are, of one joint in samples
        if "part_a.hurst" in numbers:
            rows = np.repeat(rows, 2, axis=0)
            columns = rows.T.tolist()
        else:
            [columns] = rows.tolist()
        found = of_columns(columns)
        return found if np.ndim(found) == 1 else found[:, 0]

    def of_columns(moved):
        given = dict(zip(numbers, moved, strict=True))
        faces = [dict(FACE), dict(rougher)]
        faces[0]["hurst"] = given.get("part_a.hurst", 0.8)
        if "part_b.Ra" in given:
            faces[1]["Ra"] = [f"{number!r} um" for number in given["part_b.Ra"]]
        a, b = joint.pair.metals
        bodies = Bodies(
            E=(f"{a.E!r} GPa", f"{given.get('part_b.E', b.E)!r} GPa"),
            nu=(given.get("part_a.nu", a.nu), b.nu),
            hardness=joint.bodies.hardness,
            conductivity=joint.bodies.conductivity,
        )
        other = Joint(*faces, bodies=bodies, nominal_area="4 cm^2")
        pressed = other.at_pressure(given.get("pressure", 0.01))
        return np.array([pressed.total_conductance, pressed.tangential_stiffness])

    for k in range(2):
        np.testing.assert_allclose(values[k], anew(x[k]), rtol=1e-12)
        assert_close(jacobian[k], differences(anew, list(x[k])), values[k], x[k])


def test_scipy_minimises_with_the_gradient():
    """The roughness whose gap and area are those of another surface: the other surface."""
    function = ground_function()
    wanted = ground_contact([0.42, 0.13, 100.0, 0.01])

    def cost(x):
        full = np.array([*x, 100.0, 0.01])
        values, jacobian = function.values_and_jacobian(full)
        apart = np.log(values / wanted)
        return apart @ apart, 2 * (apart / values) @ jacobian[:, :2]

    start = function.start[:2]
    assert check_grad(lambda x: cost(x)[0], lambda x: cost(x)[1], start) < 1e-5
    found = minimize(cost, start, jac=True, method="BFGS", options={"gtol": 1e-10})
    np.testing.assert_allclose(found.x, [0.42, 0.13], rtol=1e-6)
    assert found.nfev < 40


def test_jax_has_values_gradients_and_batches():
    jax = pytest.importorskip("jax")
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    try:
        function = ground_function()
        x = np.array([[0.5, 0.1, 100.0, 0.01], [0.4, 0.12, 90.0, 0.02]])
        values, jacobian = function.values_and_jacobian(x)
        of_jax = function.jax()
        np.testing.assert_allclose(jax.jit(of_jax)(x), values, rtol=1e-14)
        for transform in (jax.jacfwd, jax.jacrev):
            rows = jax.jit(jax.vmap(transform(of_jax)))(x)
            np.testing.assert_allclose(rows, jacobian, rtol=1e-12)
        one = ground_function("area").jax()
        gradient = jax.grad(lambda x: jax.numpy.log(one(x)) ** 2)(x[0])
        log_area = np.log(values[0, 0])
        expected = 2 * log_area * jacobian[0, 0] / values[0, 0]
        np.testing.assert_allclose(gradient, expected, rtol=1e-12)
        # of sums over a batch
        summed = jax.grad(lambda x: one(x).sum())(x)
        np.testing.assert_allclose(summed, jacobian[:, 0], rtol=1e-12)
    finally:
        jax.config.update("jax_enable_x64", before)


def test_torch_has_values_and_gradients():
    torch = pytest.importorskip("torch")
    function = ground_function()
    x = np.array([[0.5, 0.1, 100.0, 0.01], [0.4, 0.12, 90.0, 0.02]])
    values, jacobian = function.values_and_jacobian(x)
    given = torch.tensor(x, requires_grad=True)
    found = function.torch()(given)
    np.testing.assert_allclose(found.detach().numpy(), values, rtol=1e-14)
    weights = torch.tensor([[1.0, 2.0], [3.0, 4.0]], dtype=torch.float64)
    (found * weights).sum().backward()
    expected = np.einsum("km,kmn->kn", weights.numpy(), jacobian)
    np.testing.assert_allclose(given.grad.numpy(), expected, rtol=1e-12)
    one = torch.tensor(x[0], requires_grad=True)
    ground_function("area").torch()(one).backward()
    np.testing.assert_allclose(one.grad.numpy(), jacobian[0, 0], rtol=1e-12)


def batch():
    return ground_function(Rq=[0.4, 0.5])


test_what_is_refused = refusals(
    lambda ask: ask(),
    (lambda: ground_function()([0.5, 0.1, 100.0]), "x has 4 numbers on its last axis"),
    (lambda: ground_function()([0.5, np.nan, 100.0, 0.01]), "x"),
    (lambda: ground_function()([0.5, -0.1, 100.0, 0.01]), OutOfRangeError, "Rdq"),
    (lambda: ground_function(["aera"]), "did you mean 'area'"),
    (batch, "is of one contact"),
    (
        lambda: Joint(FACE, bodies=METALS, nominal_area="4 cm^2").function(
            "area", ["part_a.Rq"], "10 MPa"
        ),
        "did you mean 'part_a.Ra'",
    ),
)
