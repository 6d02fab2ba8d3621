"""Quantities of a law as functions of overclosure, of which each law has the numbers; jax alone."""

import jax
import jax.numpy as jnp


def _inside(law, c, value):
    """NaN outside a law's range, and so are the derivatives by c and by the law."""
    inside = (c >= law["c_least"]) & (c <= law["c_most"])
    return value * jnp.where(inside, 1.0, jnp.nan) + jnp.where(
        inside, 0.0, c
    ) * jnp.where(inside, 0.0, jnp.nan)


def _answer(law, c, value):
    """Zero without contact."""
    return _inside(law, c, jnp.where((c <= 0) & law["ends"], 0.0, value))


def _record(law, arrays, c):
    """Overclosures, their records and t, where the first record's powers apply, and t there."""
    c = jnp.asarray(c, float)
    k = jnp.searchsorted(arrays["edges"], law["scale"] * c, side="right")
    t = (
        law["scale"] * jnp.where(k < law["side"], c, c - law["h_max"])
        - arrays["centre"][k]
    ) * arrays["rate"][k]
    first = (k == 0) & law["ends"]
    t = jnp.where(first & (c <= 0), 0.0, t)
    return c, k, t, first, jnp.where(first & (t > 0), t, 1.0)


def _polynomial(rows, t):
    value = rows[..., -1]
    for j in range(rows.shape[-1] - 2, -1, -1):
        value = value * t + rows[..., j]
    return value


def _pressure(law, arrays, c):
    c, k, t, first, safe = _record(law, arrays, c)
    lead = jnp.where(first, safe ** law["power_p"], 1.0)
    return _answer(law, c, lead * _polynomial(arrays["p"][k], t))


def _tangent(law, arrays, c):
    c, k, t, first, safe = _record(law, arrays, c)
    rows, power = arrays["p"][k], jnp.where(first, law["power_p"] / safe, 0.0)
    slope = _polynomial(rows[..., 1:] * jnp.arange(1.0, 9.0), t) + power * _polynomial(
        rows, t
    )
    lead = jnp.where(first, safe ** law["power_p"], 1.0)
    return _answer(law, c, lead * slope * arrays["rate"][k] * law["scale"])


def _area(law, arrays, c):
    c, k, t, first, safe = _record(law, arrays, c)
    lead = jnp.where(first, safe ** law["power_a"], 1.0)
    return _answer(law, c, lead * _polynomial(arrays["a"][k], t))


def _energy(law, arrays, c):
    c, k, t, first, safe = _record(law, arrays, c)
    rows = arrays["p"][k] / (
        jnp.arange(1.0, 10.0) + jnp.where(first, law["power_p"], 0.0)[..., None]
    )
    lead = jnp.where(first, safe ** law["power_p"], 1.0)
    whole = lead * t * _polynomial(rows, t) / (arrays["rate"][k] * law["scale"])
    return _answer(law, c, arrays["energies"][k] + whole)


def _curve(law, curve, arrays, c):
    """A quantity with polynomials of its own, and its continuation where bodies are apart."""
    c = jnp.asarray(c, float)
    begin, end = curve["begin"], curve["end"]
    inside = jnp.where(c < begin, begin, jnp.where(c > end, end, c))
    x = curve["scale"] * (
        inside if curve["from_contact"] else law["h_max"] - 2 * inside - curve["blocked"]
    )
    k = jnp.searchsorted(arrays["edges"], x, side="right")
    # beyond half of the gaps polynomials of a quantity that begins at first contact are of u
    x = jnp.where(k < curve["side"], x, x - curve["scale"] * law["h_max"])
    t = (x - arrays["centre"][k]) * arrays["rate"][k]
    lead = jnp.where((k == 0) & (t > 0), t, 1.0) ** jnp.where(k == 0, curve["power"], 0.0)
    value = lead * _polynomial(arrays["p"][k], t) - curve["offset"]
    blocked = (k == 0) & (x <= 0) & (curve["power"] > 0)
    value = jnp.where(blocked, jnp.where(c >= curve["unknown_from"], jnp.nan, 0.0), value)
    u = law["h_max"] - jnp.where(c < begin, c, 0.0)
    value = jnp.where(c < begin, _apart(curve, u), value)
    return _inside(law, c, jnp.where(c > end, jnp.nan, value))


def _apart(curve, u):
    if curve["h_rms"]:
        return u**3 * (1 - 1.5 / ((u / curve["h_rms"]) ** 2 + 4))
    return curve["apart"] + curve["far"] / (u + curve["jump"])


def _overclosure(law, arrays, p):
    """Where pressure is p, on the branch of first contact; its derivatives are those of the inverse function."""
    p = jnp.asarray(p, float)
    begin, end = law["first"], law["c_turn"]
    least, most = _pressure(law, arrays, begin), _pressure(law, arrays, end)
    inside = (p >= least) & (p <= most)

    def step(_, state):
        c, low, high = state
        value, slope = _pressure(law, arrays, c), _tangent(law, arrays, c)
        low, high = jnp.where(value < p, c, low), jnp.where(value < p, high, c)
        # Newton's step for the logarithm of pressure: loads range over many decades
        step = value * jnp.log(p / value) / slope
        found = c * jnp.exp(step / c) if law["ends"] else c + step
        return (
            jnp.where((found >= low) & (found <= high), found, 0.5 * (low + high)),
            low,
            high,
        )

    low, high = jnp.full(p.shape, begin), jnp.full(p.shape, end)
    c = jax.lax.stop_gradient(
        jax.lax.fori_loop(0, 100, step, (0.5 * (low + high), low, high))[0]
    )
    c = c + (p - _pressure(law, arrays, c)) / jax.lax.stop_gradient(
        _tangent(law, arrays, c)
    )
    return jnp.where((p == 0) & law["ends"], 0.0, c * jnp.where(inside, 1.0, jnp.nan))
