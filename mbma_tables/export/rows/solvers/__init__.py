"""Contact laws in the formats of other programs: a file a program, each with a `RowFormat`.

All files are loaded; there is no list of them. CalculiX 2.20 and GetDP 3.2 were run. The
others follow manuals and sources, which their files name. A format is called by its name
here, too, as in `solvers.abaqus(law, name="ROAD")`.
"""

import importlib
import pkgutil

from mbma_tables.export.targets import RowFormat


def _all_formats() -> dict[str, RowFormat]:
    """Formats of all files by the names of their targets."""
    formats: dict[str, RowFormat] = {}
    for file in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{file.name}")
        for value in vars(module).values():
            if isinstance(value, RowFormat):
                formats[value.name] = value
    return formats


FORMATS = _all_formats()
TARGETS = tuple(row_format.target() for row_format in FORMATS.values())
for _name, _format in FORMATS.items():
    globals()[_name.replace("-", "_")] = _format
