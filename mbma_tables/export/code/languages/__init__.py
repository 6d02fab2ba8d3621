"""Contact laws as source code: a file a language, with its templates beside it.

A file of this folder has `LANGUAGES`, by the names of their targets. All files are loaded;
there is no list of them.
"""

import importlib
import pkgutil

from mbma_tables.export.code.language import Language


def _all_languages() -> dict[str, Language]:
    """Languages of all files; user subroutines of solvers come last."""
    languages: dict[str, Language] = {}
    subroutines: dict[str, Language] = {}
    for file in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{file.name}")
        for target, language in module.LANGUAGES.items():
            group = subroutines if language.subroutine else languages
            group[target] = language
    return languages | subroutines


LANGUAGES = _all_languages()
