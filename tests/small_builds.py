"""Small tables that build in about a second; no test here depends on a shipped table."""

from generate.tables.island4d import Island4d
from generate.tables.universal import Universal

SMALL = {
    "universal": """
target = 1e-4
certificate_points = 400
max_nodes = 5000
[axes.X]
low = 0.5
high = 6.0
[axes.mu]
high = 10.0
""",
    "island4d": """
target = 1e-3
certificate_points = 200
max_nodes = 50000
[axes.X]
low = 0.6
high = 6.0
[axes.spread]
low = 1e-3
high = 1.0
[axes.sphere]
high = 0.5
[axes.hurst]
low = 0.6
high = 0.9
""",
}
KINDS = {"universal": Universal, "island4d": Island4d}


def small(folder, kind, extra=""):
    """A small table's configuration file; `extra` comes first, so it may not repeat a key."""
    path = folder / f"{kind}.toml"
    path.write_text(extra + SMALL[kind])
    return path
