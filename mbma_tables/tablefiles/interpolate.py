"""Compiled evaluation of uniform tensor splines: two functions at once, value or value and gradient.

Positions are in node units, 0 ... n - 1. Nothing is shared or kept: any thread may call any of these.
"""

from __future__ import annotations

from numba import njit

from mbma_tables.arguments import FloatArray

Six = tuple[float, float, float, float, float, float]
Four = tuple[float, float, float, float]

_FAST = {"contract", "reassoc"}


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def quintic(u: float) -> Six:
    """The six cardinal quintic B-splines that reach the cell, at u in [0, 1] of it."""
    v = 1.0 - u
    u2, v2 = u * u, v * v
    u5, v5 = u2 * u2 * u, v2 * v2 * v
    # interior pieces by their own polynomials, the fourth and fifth as mirror images
    w1 = (26.0 + u * (-50.0 + u * (20.0 + u * (20.0 + u * (-20.0 + 5.0 * u))))) / 120.0
    w2 = (66.0 + u2 * (-60.0 + u2 * (30.0 - 10.0 * u))) / 120.0
    w3 = (66.0 + v2 * (-60.0 + v2 * (30.0 - 10.0 * v))) / 120.0
    w4 = (26.0 + v * (-50.0 + v * (20.0 + v * (20.0 + v * (-20.0 + 5.0 * v))))) / 120.0
    return v5 / 120.0, w1, w2, w3, w4, u5 / 120.0


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def quintic_slope(u: float) -> Six:
    """Derivatives of `quintic` by u."""
    v = 1.0 - u
    u2, v2 = u * u, v * v
    s1 = (-50.0 + u * (40.0 + u * (60.0 + u * (-80.0 + 25.0 * u)))) / 120.0
    s2 = u * (-120.0 + u2 * (120.0 - 50.0 * u)) / 120.0
    s3 = -v * (-120.0 + v2 * (120.0 - 50.0 * v)) / 120.0
    s4 = -(-50.0 + v * (40.0 + v * (60.0 + v * (-80.0 + 25.0 * v)))) / 120.0
    return -v2 * v2 / 24.0, s1, s2, s3, s4, u2 * u2 / 24.0


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def cubic(u: float) -> Four:
    """The four cardinal cubic B-splines that reach the cell, at u in [0, 1] of it."""
    v = 1.0 - u
    u2, v2 = u * u, v * v
    return v2 * v / 6.0, 2.0 / 3.0 - u2 * (1.0 - 0.5 * u), 2.0 / 3.0 - v2 * (1.0 - 0.5 * v), u2 * u / 6.0


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def cubic_slope(u: float) -> Four:
    """Derivatives of `cubic` by u."""
    v = 1.0 - u
    return -0.5 * v * v, u * (1.5 * u - 2.0), -v * (1.5 * v - 2.0), 0.5 * u * u


@njit(cache=True, error_model="numpy")
def cell(position: float, nodes: int) -> tuple[int, float]:
    """Cell number and place in it; the last node belongs to the last cell."""
    first = min(int(position), nodes - 2)
    return first, position - first


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def value_2d(c: FloatArray, x: float, y: float) -> tuple[float, float]:
    """Both functions of a quintic table, `c` of shape (nx + 4, ny + 4, 2)."""
    i, u = cell(x, c.shape[0] - 4)
    j, v = cell(y, c.shape[1] - 4)
    wx, wy = quintic(u), quintic(v)
    first = second = 0.0
    for k in range(6):
        a = b = 0.0
        for m in range(6):
            a += wy[m] * c[i + k, j + m, 0]
            b += wy[m] * c[i + k, j + m, 1]
        first += wx[k] * a
        second += wx[k] * b
    return first, second


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def gradient_2d(c: FloatArray, x: float, y: float) -> Six:
    """Values and derivatives of both functions: f, f_x, f_y, g, g_x, g_y."""
    i, u = cell(x, c.shape[0] - 4)
    j, v = cell(y, c.shape[1] - 4)
    wx, wy = quintic(u), quintic(v)
    sx, sy = quintic_slope(u), quintic_slope(v)
    f = fx = fy = g = gx = gy = 0.0
    for k in range(6):
        a = b = da = db = 0.0
        for m in range(6):
            p, q = c[i + k, j + m, 0], c[i + k, j + m, 1]
            a += wy[m] * p
            b += wy[m] * q
            da += sy[m] * p
            db += sy[m] * q
        f += wx[k] * a
        fx += sx[k] * a
        fy += wx[k] * da
        g += wx[k] * b
        gx += sx[k] * b
        gy += wx[k] * db
    return f, fx, fy, g, gx, gy


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def value_4d(c: FloatArray, x: float, y: float, z: float, t: float) -> tuple[float, float]:
    """Both functions of a cubic table, `c` of shape (n1 + 2, n2 + 2, n3 + 2, n4 + 2, 2)."""
    i, u = cell(x, c.shape[0] - 2)
    j, v = cell(y, c.shape[1] - 2)
    k, w = cell(z, c.shape[2] - 2)
    m, s = cell(t, c.shape[3] - 2)
    wx, wy, wz, wt = cubic(u), cubic(v), cubic(w), cubic(s)
    first = second = 0.0
    for a in range(4):
        for b in range(4):
            ab = wx[a] * wy[b]
            for e in range(4):
                weight = ab * wz[e]
                p = q = 0.0
                for f in range(4):
                    p += wt[f] * c[i + a, j + b, k + e, m + f, 0]
                    q += wt[f] * c[i + a, j + b, k + e, m + f, 1]
                first += weight * p
                second += weight * q
    return first, second


@njit(cache=True, nogil=True)
def fill_2d(c: FloatArray, x: FloatArray, y: FloatArray, out: FloatArray) -> None:
    """`value_2d` of each entry into the columns of `out` (2, entries)."""
    for k in range(x.size):
        out[0, k], out[1, k] = value_2d(c, x[k], y[k])


@njit(cache=True, nogil=True)
def fill_gradient_2d(c: FloatArray, x: FloatArray, y: FloatArray, out: FloatArray) -> None:
    """`gradient_2d` of each entry into the columns of `out` (6, entries)."""
    for k in range(x.size):
        both = gradient_2d(c, x[k], y[k])
        for row in range(6):
            out[row, k] = both[row]


@njit(cache=True, nogil=True)
def fill_4d(c: FloatArray, places: FloatArray, out: FloatArray) -> None:
    """`value_4d` of each column of `places` (4, entries) into the columns of `out` (2, entries)."""
    for k in range(places.shape[1]):
        out[0, k], out[1, k] = value_4d(c, places[0, k], places[1, k], places[2, k], places[3, k])
