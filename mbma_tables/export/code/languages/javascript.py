"""Laws in JavaScript: modules that hold the core as WebAssembly, with types for TypeScript."""

import base64
import functools
from collections.abc import Mapping

from mbma_tables.export.code.core_code import blocks_of, roughness_place
from mbma_tables.export.code.language import AskedLaw, Beside, Language
from mbma_tables.export.text import number, page_file

# the core's laws, compiled
LAW_MODULE = "law.wasm"


def _law_places(asked: AskedLaw, places: Mapping[str, str]) -> dict[str, str]:
    """The module and the blocks of the law, as text."""
    contents = {"WASM": page_file(LAW_MODULE)}
    for of, block in blocks_of(asked).items():
        contents[f"{of}_BLOCK"] = block.astype("<f8", copy=False).tobytes()
    texts = roughness_place(asked)
    for place, content in contents.items():
        texts[place] = base64.b64encode(content).decode("ascii")
    return texts


LANGUAGES = {
    "javascript-law": Language(
        template="code/languages/law.mjs",
        mark="/*",
        usage=(
            "import {{ pressure, with_tangent, curvature, area, energy, overclosure }} from "
            "'./{name}.mjs', an ECMAScript module, or require('./{name}.cjs'), the same as a "
            "CommonJS module. The C of the library itself as WebAssembly; {name}.d.mts and "
            "{name}.d.cts have the types for TypeScript. Outside the range a RangeError is "
            "thrown, of what is no number a TypeError."
        ),
        call="{what}({x})",
        law_places=_law_places,
        number=functools.partial(number, infinity="Infinity"),
        parts={"EXPORT": "export"},
        unknown="(c >= {} ? NaN : 0)",
        beside=(
            Beside(
                ".cjs", "code/languages/law.mjs", parts={"EXPORT": "module.exports ="}
            ),
            Beside(".d.mts", "code/languages/law.d.mts"),
            Beside(".d.cts", "code/languages/law.d.mts"),
        ),
    )
}
