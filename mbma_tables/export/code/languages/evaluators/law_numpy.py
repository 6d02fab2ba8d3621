"""Quantities of a law as functions of overclosure, of which each law has the numbers; numpy alone."""

import numpy as np


def _given(law, c):
    """Overclosures as an array; an error for those outside a law's range."""
    c = np.asarray(c, float)
    outside = ~((c >= law["c_least"]) & (c <= law["c_most"]))
    if outside.any():
        raise ValueError(
            f"overclosure must be in [{law['c_least']}, {law['c_most']}] {law['length']}, got {c[outside].flat[0]!r}"
        )
    return c


def _answer(law, c, value):
    """Zero without contact."""
    return np.where((c <= 0) & law["ends"], 0.0, value)[()]


def _record(law, arrays, c):
    """Overclosures, their records and t, where the first record's powers apply, and t there."""
    c = _given(law, c)
    k = np.searchsorted(arrays["edges"], law["scale"] * c, side="right")
    t = (
        law["scale"] * np.where(k < law["side"], c, c - law["h_max"])
        - arrays["centre"][k]
    ) * arrays["rate"][k]
    first = (k == 0) & law["ends"]
    t = np.where(first & (c <= 0), 0.0, t)
    return c, k, t, first, np.where(first & (t > 0), t, 1.0)


def _polynomial(rows, t):
    value = rows[..., -1]
    for j in range(rows.shape[-1] - 2, -1, -1):
        value = value * t + rows[..., j]
    return value


def _pressure(law, arrays, c):
    c, k, t, first, safe = _record(law, arrays, c)
    lead = np.where(first, safe ** law["power_p"], 1.0)
    return _answer(law, c, lead * _polynomial(arrays["p"][k], t))


def _tangent(law, arrays, c):
    c, k, t, first, safe = _record(law, arrays, c)
    rows, power = arrays["p"][k], np.where(first, law["power_p"] / safe, 0.0)
    slope = _polynomial(rows[..., 1:] * np.arange(1.0, 9.0), t) + power * _polynomial(
        rows, t
    )
    lead = np.where(first, safe ** law["power_p"], 1.0)
    return _answer(law, c, lead * slope * arrays["rate"][k] * law["scale"])


def _area(law, arrays, c):
    c, k, t, first, safe = _record(law, arrays, c)
    lead = np.where(first, safe ** law["power_a"], 1.0)
    return _answer(law, c, lead * _polynomial(arrays["a"][k], t))


def _energy(law, arrays, c):
    c, k, t, first, safe = _record(law, arrays, c)
    rows = arrays["p"][k] / (
        np.arange(1.0, 10.0) + np.where(first, law["power_p"], 0.0)[..., None]
    )
    lead = np.where(first, safe ** law["power_p"], 1.0)
    whole = lead * t * _polynomial(rows, t) / (arrays["rate"][k] * law["scale"])
    return _answer(law, c, arrays["energies"][k] + whole)


def _curve(law, curve, arrays, c):
    """A quantity with polynomials of its own, and its continuation where bodies are apart."""
    c = _given(law, c)
    begin, end = curve["begin"], curve["end"]
    inside = np.clip(c, begin, end)
    x = curve["scale"] * (
        inside if curve["from_contact"] else law["h_max"] - 2 * inside - curve["blocked"]
    )
    k = np.searchsorted(arrays["edges"], x, side="right")
    # beyond half of the gaps polynomials of a quantity that begins at first contact are of u
    x = np.where(k < curve["side"], x, x - curve["scale"] * law["h_max"])
    t = (x - arrays["centre"][k]) * arrays["rate"][k]
    lead = np.where((k == 0) & (t > 0), t, 1.0) ** np.where(k == 0, curve["power"], 0.0)
    value = lead * _polynomial(arrays["p"][k], t) - curve["offset"]
    blocked = (k == 0) & (x <= 0) & (curve["power"] > 0)
    value = np.where(blocked, np.where(c >= curve["unknown_from"], np.nan, 0.0), value)
    u = law["h_max"] - np.where(c < begin, c, 0.0)
    value = np.where(c < begin, _apart(curve, u), value)
    return np.where(c > end, np.nan, value)[()]


def _apart(curve, u):
    if curve["h_rms"]:
        return u**3 * (1 - 1.5 / ((u / curve["h_rms"]) ** 2 + 4))
    return curve["apart"] + curve["far"] / (u + curve["jump"])


def _overclosure(law, arrays, p):
    """Where pressure is p, on the branch of first contact."""
    p = np.asarray(p, float)
    begin, end = law["first"], law["c_turn"]
    least, most = _pressure(law, arrays, begin), _pressure(law, arrays, end)
    inside = (p >= least) & (p <= most)
    if not inside.all():
        raise ValueError(
            f"pressure must be in [{least}, {most}] {law['stress']}, got {p[~inside].flat[0]!r}"
        )
    low, high = np.full(p.shape, begin), np.full(p.shape, end)
    c = 0.5 * (low + high)
    with np.errstate(all="ignore"):
        for _ in range(200):
            value, slope = _pressure(law, arrays, c), _tangent(law, arrays, c)
            low, high = np.where(value < p, c, low), np.where(value < p, high, c)
            # Newton's step for the logarithm of pressure: loads range over many decades
            step = value * np.log(p / value) / slope
            found = c * np.exp(step / c) if law["ends"] else c + step
            before, c = (
                c,
                np.where((found >= low) & (found <= high), found, 0.5 * (low + high)),
            )
            if (
                np.abs(c - before)
                <= 4e-16 * np.abs(before if law["ends"] else law["h_max"])
            ).all():
                break
    return np.where(law["ends"] & (p == 0), 0.0, c)[()]
