"""The pressure that seals to a given leak rate."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from mbma_tables.common.arguments import require
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.contacts.quantities.gas_flow import RATE_UNITS

LIGHTEST = 1e-5  # A/A0 of the lightest contact that is tried
FULLEST = 0.65  # and of the fullest: contact blocks flow before
BLOCKED = -1e3  # stands for ln of a rate of zero
BESIDE = 1e-6  # share of the area
REACHED = 1e-3  # ln of the rate over the wanted one
XTOL = 1e-10  # of ln A/A0
_RATE = re.compile(r"\s*([-+.\deE]+)\s+(\S.*\S)\s*")


class SealingPressure(NamedTuple):
    """The pressure that seals to a leak rate; `low` and `high` are one standard deviation of ln rate away."""

    pressure: float  #: F/A0 [stress of the law]
    low: float
    high: float
    area: float  #: A/A0 there
    scatter: float  #: standard deviation of ln of the leak rate there
    valid: bool  #: whether flow through such contacts was simulated


def sealing_pressure(
    law: ContactLaw,
    rate: str,
    *,
    gas: str | Mapping[str, Any],
    inlet: ArrayLike | str,
    outlet: ArrayLike | str,
    width: ArrayLike | str,
    length: ArrayLike | str | None = None,
    temperature: float = 293.15,
) -> SealingPressure:
    """The pressure F/A0 at which a contact leaks a gas at a given rate.

    Parameters
    ----------
    law : ContactLaw
        Of `contact_law`, or ``joint.law()``.
    rate : str
        Such as "1e-6 mbar l/s"; without `length` per metre of seal.
    gas, inlet, outlet, width, length, temperature
        As for `Leakage.gas`.

    Returns
    -------
    SealingPressure
        With `low` and `high`, where the rate is reached if flow is one standard deviation
        smaller or larger than the law's; both are NaN where that is not known.

    Raises
    ------
    InputError, OutOfRangeError
        For a rate without a known unit, and one that even the lightest contact of the law
        does not leak.

    Examples
    --------
    >>> from mbma_tables import Surface, contact_law
    >>> face = Surface(hurst=0.8, q0=0.01, q1=0.4, h_rms=2.0, h_max=7.0, unit="um")
    >>> law = contact_law(face, "20 MPa", theory="calibrated")
    >>> seal = {"inlet": "2 bar", "outlet": "1 bar", "width": "2 mm", "length": "0.2 m"}
    >>> found = sealing_pressure(law, "1 mg/h", gas="nitrogen", **seal)
    >>> f"{found.pressure:.2f} MPa, {found.low:.2f} to {found.high:.2f}"
    '0.24 MPa, 0.23 to 0.26'
    """
    wanted, unit = _rate(rate)
    seal = {
        "gas": gas,
        "inlet": inlet,
        "outlet": outlet,
        "width": width,
        "length": length,
        "temperature": temperature,
        "unit": unit,
    }
    deepest = law.lowest if law.area_turning_point is None else law.area_turning_point
    fullest = min(FULLEST, float(law.area(separation=deepest)))
    interval = math.log(LIGHTEST), math.log(fullest)

    def ln_rate(log_area: float, deviations: float) -> float:
        leak = law.at(area=math.exp(log_area)).leakage
        found = float(leak.through(seal))
        if not found > 0:
            return BLOCKED
        error = 0.0
        if deviations:
            of_flow = deviations * leak.scatter
            error = float(leak.error_of_rate(seal, of_flow, deviations))
        return math.log(found / wanted) + error

    lightest, heaviest = (ln_rate(end, 0.0) for end in interval)
    if lightest < 0:
        raise OutOfRangeError(
            f"rate = {rate!r}: a contact on {LIGHTEST:g} of the area leaks less, "
            f"{math.exp(lightest) * wanted:.3g} {unit}"
        )
    if heaviest > 0:
        raise OutOfRangeError(
            f"rate = {rate!r}: the law ends at {math.exp(interval[1]):.3g} of the area, where "
            "the contact leaks more"
        )

    def sealed(deviations: float) -> float:
        """A/A0 where the rate is reached, NaN where the scatter is not known or the law does not reach it."""
        ends = [ln_rate(end, deviations) for end in interval]
        if not ends[0] >= 0 >= ends[1]:
            return math.nan
        return math.exp(brentq(ln_rate, *interval, (deviations,), XTOL))

    area = sealed(0.0)
    leak = law.at(area=area).leakage
    # of contacts that yield the flow is not known where the elastic contact is blocked
    beyond = law.at(area=area * (1 + BESIDE)).leakage.K
    if abs(ln_rate(math.log(area), 0.0)) > REACHED and math.isnan(float(beyond)):
        raise OutOfRangeError(
            f"rate = {rate!r}: from {area:.4g} of the area on the contact yields and its flow is "
            "not known; it leaks more before"
        )
    scatter = float(leak.scatter_of_rate(seal))
    ends = [math.nan if math.isnan(scatter) else sealed(sign) for sign in (-1.0, 1.0)]
    pressure, low, high = (
        math.nan if math.isnan(one) else float(law.at(area=one).pressure)
        for one in (area, *ends)
    )
    return SealingPressure(pressure, low, high, area, scatter, bool(leak.valid))


def _rate(rate: str) -> tuple[float, str]:
    """A leak rate's number and unit."""
    match = _RATE.fullmatch(rate) if isinstance(rate, str) else None
    if match is None or match[2] not in RATE_UNITS:
        raise InputError(
            f"rate = {rate!r} must be a number with its unit, such as '1e-6 mbar l/s': one of "
            f"{', '.join(RATE_UNITS)}"
        )
    number = float(match[1])
    require("rate", np.asarray(number), np.asarray(number > 0), "positive")
    return number, match[2]
