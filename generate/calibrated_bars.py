"""What the calibrated law is held to on surfaces that no fit saw, and what two surfaces of one spectrum differ by."""

from typing import Any

import numpy as np
import pandas as pd

from generate.boundary_elements.surfaces import TRAINING

LARGE = 512  # points a side from which on surfaces are told apart
PLAIN, FILTERED, EVERY = ("self_affine",), ("plateau", "filtered"), ("self_affine", "plateau", "filtered")
# form, quantity, range of contact, limit to nine errors in ten, kinds of surfaces, longest waves a side
BARS = (
    ("spectrum", "area", (0.01, 0.03), 0.10, PLAIN, (2, 2)),
    ("spectrum", "area", (0.01, 0.03), 0.05, PLAIN, (3, 99)),
    ("spectrum", "area", (0.03, 0.97), 0.05, PLAIN, (2, 99)),
    ("spectrum", "force", (0.01, 0.10), 0.20, PLAIN, (2, 99)),
    ("spectrum", "force", (0.10, 0.97), 0.08, PLAIN, (2, 99)),
    ("spectrum", "stiffness", (0.01, 0.10), 0.12, PLAIN, (2, 99)),
    ("spectrum", "stiffness", (0.10, 0.90), 0.12, PLAIN, (2, 99)),
    ("spectrum", "stiffness", (0.90, 0.98), 0.12, PLAIN, (2, 99)),
    ("spectrum", "area", (0.002, 0.97), 0.12, FILTERED, (2, 99)),
    ("spectrum", "force", (0.002, 0.03), 0.15, FILTERED, (2, 99)),
    ("spectrum", "force", (0.03, 0.97), 0.10, FILTERED, (2, 99)),
    ("map", "area", (0.002, 0.97), 0.10, EVERY, (1, 99)),
    ("map", "force", (0.01, 0.10), 0.10, PLAIN, (2, 99)),
    ("map", "force", (0.002, 0.01), 0.15, EVERY, (4, 99)),
    ("map", "force", (0.002, 0.01), 0.25, EVERY, (1, 2)),
    ("map", "area", (0.002, 0.97), 0.10, ("stretched",), (2, 99)),
    ("map", "force", (0.002, 0.01), 0.15, ("stretched",), (2, 99)),
    ("map", "force", (0.01, 0.10), 0.10, ("stretched",), (2, 99)),
)


def _nine_in_ten(values: Any) -> float:
    return float(np.quantile(np.abs(values), 0.9)) if len(values) else float("nan")


def measure(forms: dict[str, pd.DataFrame]) -> list[dict[str, Any]]:
    """Of each bar: nine errors in ten, also of large grids alone, and nine in ten of a spectrum's own differences.

    These are the errors' distances from the mean of their spectrum and load on all surfaces, widened for the mean's own
    scatter: no law of the same knowledge that is right in the mean does better. `forms` has errors by form of the law.
    """
    told = []
    for form, quantity, contact, limit, kinds, (low, high) in BARS:
        frame = forms[form]
        own = frame[frame["kind"].isin(kinds) & frame["waves"].between(low, high)]
        seen = own[own["split"] != TRAINING]
        inside = seen[seen["contact"].between(*contact) & np.isfinite(seen[quantity])]
        errors = np.expm1(inside[quantity])
        # loads that all surfaces of a spectrum have, where there are several
        loads = own.groupby(["node", "surface"])["load"].transform("size").groupby(own["node"]).transform("min")
        several = own[(own.groupby("node")["surface"].transform("nunique") > 1) & (own["load"] < loads)]
        groups = several.groupby(["node", "load"])
        apart = several[quantity] - groups[quantity].transform(lambda e: e.mean(skipna=False))
        count = groups[quantity].transform("size")
        spread = (apart * np.sqrt(count / (count - 1)))[groups["contact"].transform("mean").between(*contact)]
        waves = f"{low} or more waves" if high == 99 else f"{low} to {high} waves" if high > low else f"{low} waves"
        span = "-".join(f"{100 * a:g}" for a in contact)
        what = f"{quantity} by {form}, {span}% contact, {' '.join(kinds).replace('_', '-')}, {waves}"
        large = seen["points"] >= LARGE
        told.append(
            {"what": what, "limit": limit, "surfaces": seen["surface"].nunique()}
            | {"surfaces_large": seen["surface"][large].nunique(), "found": _nine_in_ten(errors)}
            | {"large": _nine_in_ten(errors[inside["points"] >= LARGE]), "mean": float(errors.mean())}
            | {"noise": _nine_in_ten(spread[np.isfinite(spread)])}
        )
    return told
