"""Where the data files that come with the library stand."""

from __future__ import annotations

import pathlib


def shipped_file(name: str) -> pathlib.Path:
    """Path of a file of `tables`: in the installed package, or in a checkout's `tables` folder."""
    package = pathlib.Path(__file__).parents[1]
    inside = package / "tables" / name
    return inside if inside.exists() else package.parent / "tables" / name
