"""Contact laws as source code: a file a language, with its templates beside it.

A file of this folder has `LANGUAGES`, by the names of their targets, and so have those of
`subroutines`. All files are loaded; there is no list of them.
"""

import importlib
import pkgutil
from types import ModuleType

from mbma_tables.export.code import subroutines
from mbma_tables.export.code.language import Language


def _languages_of(package: str, path: list[str]) -> dict[str, Language]:
    """Languages of the files of a folder."""
    languages: dict[str, Language] = {}
    for file in pkgutil.iter_modules(path):
        module: ModuleType = importlib.import_module(f"{package}.{file.name}")
        languages |= module.LANGUAGES
    return languages


LANGUAGES = {
    **_languages_of(__name__, __path__),
    **_languages_of(subroutines.__name__, list(subroutines.__path__)),
}
