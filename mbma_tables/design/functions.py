"""Quantities of contacts as differentiable functions of some numbers, for optimisers, JAX and PyTorch.

Neither is imported before its function is made, and neither is a dependency.
"""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import (
    FloatArray,
    finite_array,
    hinted,
    require_name,
)
from mbma_tables.common.errors import InputError
from mbma_tables.contacts.quantities import registry
from mbma_tables.design.derivatives import Described
from mbma_tables.design.sensitivity import Sensitivity, described_contact, sensitivity_of
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import Theory, UserTheory


@dataclasses.dataclass(frozen=True, eq=False)
class ContactFunction:
    """Quantities of contacts as a function of some numbers of their description; all others are constant.

    Made by `contact_function` and `Joint.function`. Its argument has the numbers on its last
    axis, in their units; other axes are a batch. Of one quantity, given by its name, the
    value has no axis of quantities.

    Raises
    ------
    InputError, OutOfRangeError
        As `contact`, for numbers of which there is no contact.
    """

    described: Described
    quantities: tuple[str, ...]
    numbers: tuple[str, ...]  #: names of the numbers, in the order of the last axis
    is_one: bool  # whether a value has no axis of quantities

    @classmethod
    def of(
        cls, described: Described, quantities: str | Sequence[str], numbers: Sequence[str]
    ) -> ContactFunction:
        """The function of numbers by the names that results have for them."""
        labels = described.unknowns.labels
        own = {labels.get(name, name): name for name in described.numbers}
        if isinstance(numbers, str) or not numbers:
            raise InputError(f"numbers are a list of names, got {numbers!r}")
        for name in numbers:
            require_name("number", name, own)
        is_one = isinstance(quantities, str)
        names = [quantities] if isinstance(quantities, str) else list(quantities)
        if not names:
            raise InputError("quantities are a name or a list of names, got none")
        for name in names:
            registry.get(name)
        if described.shape != ():
            raise InputError(
                "a function is of one contact, whose numbers its argument replaces: "
                "give one surface, one of each constant, and one pressure"
            )
        return cls(described, tuple(names), tuple(own[name] for name in numbers), is_one)

    @property
    def start(self) -> FloatArray:
        """The numbers as they were described, with which a search may begin."""
        return np.array([float(self.described.numbers[name]) for name in self.numbers])

    def __call__(self, x: ArrayLike) -> Any:
        """The quantities at numbers, shape (..., n): (..., quantities), or (...) of one."""
        values = self._over_entries(x, lambda moved: self._values(moved))
        return self._shaped(values)

    def values_and_jacobian(self, x: ArrayLike) -> tuple[Any, FloatArray]:
        """The quantities at numbers, shape (..., n), and their derivatives: (..., quantities, n), or (..., n) of one."""
        both = self._over_entries(x, self._with_jacobian)
        values = self._shaped(both[..., 0])
        jacobian = both[..., 1:]
        return values, jacobian[..., 0, :] if self.is_one else jacobian

    def jacobian(self, x: ArrayLike) -> FloatArray:
        """The derivatives of `values_and_jacobian`."""
        return self.values_and_jacobian(x)[1]

    def sensitivity(self, x: ArrayLike) -> Sensitivity:
        """Values and derivatives by all numbers at one x, as a table."""
        columns = self._checked(x)
        if columns.ndim != 1:
            raise InputError(f"a table is of one contact, got shape {columns.shape}")
        return sensitivity_of(self._moved(columns), self.quantities)

    def jax(self) -> Callable[..., Any]:
        """The function for JAX: `jit`, `grad`, `jacfwd`, `jacrev` and `vmap` apply; second derivatives do not.

        Numbers keep their type: without ``jax.config.update("jax_enable_x64", True)`` they
        have 7 digits.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2", theory="calibrated")
        >>> area = joint.function("area", ["part_a.Rq", "pressure"], "50 MPa")
        >>> import jax  # doctest: +SKIP
        >>> jax.grad(jax.jit(area.jax()))(area.start)  # doctest: +SKIP
        """
        jax = importlib.import_module("jax")
        jnp = jax.numpy
        count = len(self.numbers)
        end = () if self.is_one else (len(self.quantities),)

        def asked(function: Callable[[Any], Any], x: Any, *ends: tuple[int, ...]) -> Any:
            """Results of numpy at x, with `ends` after the axes of the batch."""
            shapes = [
                jax.ShapeDtypeStruct((*x.shape[:-1], *own), x.dtype) for own in ends
            ]

            def of_numpy(given: Any) -> list[Any]:
                found = function(np.asarray(given, dtype=float))
                return [np.asarray(each, dtype=x.dtype) for each in found]

            return jax.pure_callback(of_numpy, shapes, x, vmap_method="broadcast_all")

        @jax.custom_jvp
        def function(x: Any) -> Any:
            """The quantities at numbers."""
            [values] = asked(lambda given: [self(given)], jnp.asarray(x), end)
            return values

        @function.defjvp
        def _(primals: Any, tangents: Any) -> Any:
            x = jnp.asarray(primals[0])
            jacobian_end = (*end, count)
            values, jacobian = asked(self.values_and_jacobian, x, end, jacobian_end)
            tangent = tangents[0] if self.is_one else tangents[0][..., None, :]
            return values, (jacobian * tangent).sum(axis=-1)

        return lambda x: function(jnp.asarray(x))

    def torch(self) -> Callable[..., Any]:
        """The function for PyTorch, of tensors; `backward` gives gradients, of first order.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2", theory="calibrated")
        >>> area = joint.function("area", ["part_a.Rq", "pressure"], "50 MPa")
        >>> import torch  # doctest: +SKIP
        >>> x = torch.tensor(area.start, requires_grad=True)  # doctest: +SKIP
        >>> area.torch()(x).backward()  # doctest: +SKIP
        """
        torch = importlib.import_module("torch")
        values_and_jacobian = self.values_and_jacobian
        is_one = self.is_one

        class Quantities(torch.autograd.Function):  # type: ignore[misc, name-defined]
            """The quantities at numbers, with the derivatives that were computed beside them."""

            @staticmethod
            def forward(ctx: Any, x: Any) -> Any:
                values, jacobian = values_and_jacobian(x.detach().cpu().numpy())
                ctx.save_for_backward(x.new_tensor(jacobian))
                return x.new_tensor(values)

            @staticmethod
            @torch.autograd.function.once_differentiable
            def backward(ctx: Any, gradient: Any) -> Any:
                [jacobian] = ctx.saved_tensors
                if is_one:
                    return gradient[..., None] * jacobian
                return (gradient[..., None] * jacobian).sum(dim=-2)

        function: Callable[..., Any] = Quantities.apply
        return function

    def _values(self, moved: Described) -> FloatArray:
        pressed = moved.contact()
        shape = np.broadcast_shapes(moved.shape, np.shape(pressed.pressure))
        rows = [
            np.broadcast_to(pressed.quantity(name), shape) for name in self.quantities
        ]
        return np.stack(rows, axis=-1)

    def _with_jacobian(self, moved: Described) -> FloatArray:
        """Values, and after them derivatives, on a last axis."""
        labels = moved.unknowns.labels
        found = sensitivity_of(moved, self.quantities)
        known = set(found.parameters)
        rows = [labels.get(name, name) for name in self.numbers]
        values, jacobian = found.values_and_jacobian(
            self.quantities, [name for name in rows if name in known]
        )
        # quantities do not depend on numbers that have no row
        both = np.zeros((*values.shape, 1 + len(rows)))
        both[..., 0] = values
        both[..., [k + 1 for k, name in enumerate(rows) if name in known]] = jacobian
        return both

    def _over_entries(
        self, x: ArrayLike, function: Callable[[Described], FloatArray]
    ) -> FloatArray:
        """A function of what is described by x: in one batch, or entry by entry where no batch can be made."""
        columns = self._checked(x)
        at_once = self.described.is_batched(self.numbers, self.quantities)
        if at_once or columns.ndim == 1:
            return function(self._moved(columns))
        shape = columns.shape[:-1]
        rows = columns.reshape(-1, len(self.numbers))
        stacked = np.stack([function(self._moved(row)) for row in rows])
        return stacked.reshape(*shape, *stacked.shape[1:])

    def _checked(self, x: ArrayLike) -> FloatArray:
        columns = finite_array("x", x)
        if columns.ndim == 0 or columns.shape[-1] != len(self.numbers):
            raise InputError(
                f"x has {len(self.numbers)} numbers on its last axis, {', '.join(self.numbers)}; "
                f"got shape {columns.shape}"
            )
        return columns

    def _moved(self, columns: FloatArray) -> Described:
        """What is described by rows of numbers."""
        moved = {name: columns[..., k][()] for k, name in enumerate(self.numbers)}
        return self.described.moved(moved)

    def _shaped(self, values: FloatArray) -> Any:
        return values[..., 0][()] if self.is_one else values


@hinted
def contact_function(
    surface: AnySurface,
    bodies: Bodies | float | str = 1.0,
    *,
    quantities: str | Sequence[str],
    numbers: Sequence[str],
    separation: float | str | None = None,
    mean_separation: float | str | None = None,
    pressure: float | str | None = None,
    area: float | None = None,
    theory: str | Theory | UserTheory | None = None,
) -> ContactFunction:
    """Quantities of a contact as a differentiable function of some numbers of its description.

    Parameters
    ----------
    surface, bodies, theory : as for `contact`
        Of one contact. Numbers that the function does not take stay as they are here.
    quantities : str or sequence of str
        Names of quantities.
    numbers : sequence of str
        Names of the numbers that the function takes, as `sensitivity` has them, such as
        "h_rms" or "Ra", "E_star", "pressure".
    separation, mean_separation, pressure, area : float or str, one of them
        As for `contact`. Where it is among the numbers, that at which a search begins.

    Returns
    -------
    ContactFunction

    Raises
    ------
    InputError, OutOfRangeError
        As `sensitivity`; for names that are unknown, and for batches.

    Examples
    --------
    The height of the face whose gap is 1 um at 10 MPa:

    >>> from mbma_tables import Surface, contact_function
    >>> from scipy.optimize import root
    >>> ground = Surface.from_roughness(Rq=0.5, Rdq=0.1, longest=100, hurst=0.8, h_max=1.8, unit="um")
    >>> gap = contact_function(
    ...     ground, "100 GPa", quantities=["mean_separation"], numbers=["Rq"],
    ...     pressure="10 MPa", theory="calibrated",
    ... )
    >>> found = root(lambda x: gap(x) - 1.0, gap.start, jac=gap.jacobian)
    >>> f"Rq = {found.x[0]:.4f} um after {found.nfev} contacts"
    'Rq = 0.3990 um after 8 contacts'
    """
    held = {
        "separation": separation,
        "mean_separation": mean_separation,
        "pressure": pressure,
        "area": area,
    }
    described = described_contact(surface, bodies, held, theory)
    return ContactFunction.of(described, quantities, numbers)
