"""A reader of table files that uses only what docs/tables.md says: numpy, netCDF4 and the standard library.

Slow and plain on purpose: it shares no line with the library that wrote the files.
"""

import hashlib
import json
import math

import netCDF4
import numpy as np

SEAL = b"\nmbma-table sha256 "
U = np.arange(-192, 273) / 64
T = np.exp(U - np.exp(-U))
ENDS = ("low", "high")


def height_integral(n, x):
    """F_n(x) by the sum that the files give."""
    density = np.exp(-((x + T) ** 2) / 2) / math.sqrt(2 * math.pi)
    return float(np.sum(T ** (n + 1) * (1 + np.exp(-U)) * density)) / 64


def weights(u):
    """B-spline weights of the coefficients i ... i + 5."""
    v = 1 - u
    ends = [1 + 5 * t * (1 + t * (2 + t * (2 + t * (1 - t)))) for t in (v, u)]
    middle = [66 - 60 * t**2 + 30 * t**4 - 10 * t**5 for t in (u, v)]
    return np.array([v**5, ends[0], *middle, ends[1], u**5]) / 120


def chebyshev(t):
    """T_0 ... T_7 at t in [-1, 1]."""
    return np.cos(np.arange(8) * math.acos(min(1.0, max(-1.0, t))))


def seal_matches(path):
    """Whether the last line of a file is the hash of what stands before it."""
    body, seal, digest = path.read_bytes().rpartition(SEAL)
    return bool(seal) and digest == hashlib.sha256(body).hexdigest().encode() + b"\n"


def _json_digest(content):
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _attributes(owner):
    return {name: np.asarray(owner.getncattr(name)).tolist() for name in owner.ncattrs()}


class Reader:
    """One table file, held in memory."""

    def __init__(self, path):
        with netCDF4.Dataset(path) as file:
            self.attributes = _attributes(file)
            self.variables = {
                name: np.asarray(variable[...])
                for name, variable in file.variables.items()
            }
            self.described = {
                name: _attributes(variable) for name, variable in file.variables.items()
            }
            self.dimensions = {
                name: list(variable.dimensions)
                for name, variable in file.variables.items()
            }
        self.axes = self.dimensions.get("log_ratio_F")

    # hashes

    def values_sha256(self):
        digest = hashlib.sha256()
        for name in sorted(self.variables):
            values = self.variables[name].astype("<f8")
            digest.update(f"{name}:<f8:{values.shape};".encode())
            digest.update(values.tobytes(order="C"))
        return digest.hexdigest()

    def attributes_sha256(self):
        content = {
            "": {n: v for n, v in self.attributes.items() if n != "attributes_sha256"}
        }
        for name, described in self.described.items():
            content[name] = {**described, "dimensions": self.dimensions[name]}
        return _json_digest(content)

    def configuration_sha256(self):
        return _json_digest(
            [
                json.loads(self.attributes[name])
                for name in ("configuration", "variant_numbers")
            ]
        )

    # lookup

    def position(self, name, x):
        axis = self.described[name]
        nodes = self.variables[name].size
        if not axis["first"] <= x <= axis["last"]:
            raise ValueError(f"{name} = {x} is not covered")
        ends = (axis["first"], axis["last"], x)
        low, high, t = (
            math.log(e + axis["offset"]) if axis["transform"] == "log" else e
            for e in ends
        )
        return (t - low) / ((high - low) / (nodes - 1))

    def spline(self, function, point):
        """g_F or g_A at coordinates of the axes."""
        block = self.variables[f"spline_{function}"]
        for name, x in zip(self.axes, point, strict=True):
            p = self.position(name, x)
            i = min(math.floor(p), self.variables[name].size - 2)
            # each step takes the first axis that is left
            block = np.tensordot(weights(p - i), block[i : i + 6], axes=1)
        return float(block)

    def answer(self, **arguments):
        """What conformance points hold: Phi or hat values, by F and A."""
        return (
            self.universal(**arguments)
            if self.attributes["mbma_kind"] == "universal"
            else self.island(**arguments)
        )

    @staticmethod
    def rigid(X, mu):
        return {
            "F": math.pi * mu * height_integral(2.5, -X) / 5,
            "A": math.pi * height_integral(2, -X) / 2,
        }

    def cell(self, X, mu):
        """The cell of an island; on an edge, the first of its cells."""
        X_low, X_high, mu_low, mu_high = (
            self.variables[f"{name}_{end}"] for name in ("X", "mu") for end in ENDS
        )
        found = np.flatnonzero(
            (X_low <= X) & (X_high >= X) & (mu_low <= mu) & (mu <= mu_high)
        )
        if found.size == 0:
            raise ValueError(f"X = {X}, mu = {mu} is not covered")
        return int(found[0])

    def universal(self, X, mu):
        cell = self.cell(X, mu)
        X_low, X_high, low, high = (
            float(self.variables[f"{n}_{end}"][cell]) for n in ("X", "mu") for end in ENDS
        )
        x = (2 * X - X_low - X_high) / (X_high - X_low)
        if low == 0:
            y = 2 * mu / high - 1
        else:
            a = math.sqrt(low)
            b = math.sqrt(high)
            y = (b + a) / (b - a) * (mu - a * b) / (mu + a * b)
        sums = {
            f: chebyshev(x) @ self.variables[f"chebyshev_{f}"][cell] @ chebyshev(y)
            for f in "FA"
        }
        return {"F": mu * float(sums["F"]), "A": float(sums["A"])}

    def band(self, spread, sphere, hurst):
        """mu, sigma and rate of a band; sphere gives zeta_d."""
        w = math.log1p(spread)
        power = 4 - 2 * hurst

        def g(p):
            return math.expm1(p * w) / (p * w) if p * w else 1.0

        growth = g(power) / g(2 - 2 * hurst)
        alpha = 1.5 * g(-2 * hurst) * growth / g(2 - 2 * hurst)
        sigma = math.sqrt((1 - 0.8968 / alpha) * 2 * hurst * w * g(-2 * hurst))
        rate = 0.75 * growth / json.loads(self.attributes["variant_numbers"])[0]
        inverse = sphere * 1.25**-power
        c = 0.75 * hurst / power
        m4_d = c * (1 - inverse)
        m4_u = c * (math.exp(power * w) - inverse)
        radius = 3 * math.sqrt(math.pi) / 8
        return (
            8 / 3 * rate * sigma * radius * math.sqrt(2) / (m4_d * m4_u) ** 0.25,
            sigma,
            rate,
        )

    def island(self, delta_over_h_rms, zeta_d, zeta_u, hurst):
        spread = (zeta_u - zeta_d) / zeta_d
        power = 4 - 2 * hurst
        sphere = (1.25 / zeta_d) ** power
        mu, sigma, rate = self.band(spread, sphere, hurst)
        X = (delta_over_h_rms * zeta_d**hurst - 1) / sigma
        inside = max(spread, self.described["spread"]["first"])
        share = mu / self.band(inside, sphere, hurst)[0]
        rigid = self.rigid(X, mu)
        phi = {
            f: math.exp(share * self.spline(f, (X, inside, sphere, hurst))) * rigid[f]
            for f in rigid
        }
        c = 0.75 * hurst / power
        radius = 3 * math.sqrt(math.pi) / 8
        log_d = math.log(zeta_d)
        S = sigma * zeta_d**-hurst
        D = rate * zeta_d**2
        R_d = radius / math.sqrt(c * math.expm1(power * log_d))
        R_u = radius / math.sqrt(c * math.expm1(power * (log_d + math.log1p(spread))))
        return {
            "F": S * math.sqrt(2 * R_d * S) * phi["F"],
            "A": 2 * math.pi * D * R_u * R_d * S**2 * phi["A"],
        }

    def replay(self):
        """Largest of |own answer/stored - 1|/tolerance over the conformance points."""
        prefix = "conformance_"
        worst = 0.0
        points = {
            n.removeprefix(prefix): values
            for n, values in self.variables.items()
            if n.startswith(prefix)
        }
        known = [
            n for n in points if n != "tolerance" and n[:5] not in ("table", "exact")
        ]
        for k, tolerance in enumerate(points["tolerance"]):
            for f, value in self.answer(
                **{name: float(points[name][k]) for name in known}
            ).items():
                worst = max(worst, abs(value / points[f"table_{f}"][k] - 1) / tolerance)
        return worst
