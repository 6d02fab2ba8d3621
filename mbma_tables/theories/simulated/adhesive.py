"""Boundary elements of a map whose faces attract each other, E* = 1: soft attractions, and contact through pull-off.

The attraction of the gaps found last is held while the contact is solved as an elastic one of
the surface that it deforms, and renewed until it no longer changes. What is given is the sum of
contact pressures, the net pressure and that attraction: it rises along the whole path
from pull-off on, where the net pressure does not. Contacts whose edges neck have no such path,
and are refused.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.theories.simulated.boundary_elements import (
    TOLERANCE,
    BoundaryElementContact,
)

MOST_RENEWALS = 200
SETTLED = (
    1e-7  # change of the attraction over the mean contact pressure, root mean square
)
# renewals over which changes shrink to this share at least
HOLDING = 30
HALVED = 0.5


class AdhesiveContact:
    """A map against a rigid plane that attracts it.

    Parameters
    ----------
    surface, sizes : ndarray of shape (n, m), pair of float
        Heights and sides of the map [length].
    traction : callable
        Attraction over E* at an array of gaps [length].
    tolerance, mirrored
        As for `BoundaryElementContact`.
    """

    def __init__(
        self,
        surface: FloatArray,
        sizes: tuple[float, float],
        traction: Callable[[FloatArray], FloatArray],
        tolerance: float = TOLERANCE,
        mirrored: bool = False,
    ) -> None:
        self._heights = np.asarray(surface, float) - np.mean(surface)
        self._contact = BoundaryElementContact(
            self._heights, sizes, tolerance, mirrored=mirrored
        )
        self._traction = traction
        self._pull: FloatArray = np.zeros(self._heights.shape)

    def press(self, force: float) -> dict[str, float]:
        """Contact under a mean contact pressure over E*, the net one and the attraction together.

        Raises
        ------
        ConvergenceError
            Where the attraction does not settle, as in contacts whose edges neck.
        """
        contact = self._contact
        changes: list[float] = []
        found: dict[str, float] = {}
        while not changes or changes[-1] > SETTLED:
            contact.surface = self._heights + contact.deflect(self._pull)
            found = contact.press(force)
            renewed = self._traction(contact.gap)
            change = float(np.sqrt(np.mean((renewed - self._pull) ** 2))) / force
            self._pull = renewed
            changes.append(change)
            lasts = len(changes) > HOLDING and change > HALVED * changes[-HOLDING]
            if lasts or len(changes) == MOST_RENEWALS:
                self._pull = np.zeros(self._heights.shape)
                contact.pressure = None
                raise ConvergenceError(
                    f"the attraction under a contact pressure of {force:g} E* does not "
                    "settle: edges of such contacts neck, and area and force depend on the path"
                )
        net = contact.traction - self._pull
        return {
            "net_pressure": float(net.mean()),
            "area": found["area"],
            "area_raw": found["area_raw"],
            "area_compressed": float((net > 0).mean()),
            "mean_separation": float(contact.gap.mean()),
            "residual": found["residual"],
            "renewals": float(len(changes)),
        }

    @property
    def gap(self) -> FloatArray:
        """Gaps of the last contact, zero where it touches."""
        return self._contact.gap

    @property
    def net_traction(self) -> FloatArray:
        """Net pressures of the last contact over E*."""
        return np.asarray(self._contact.traction - self._pull)
