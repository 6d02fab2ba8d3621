"""Laws in JavaScript: modules that hold the core as WebAssembly, with types for TypeScript."""

import base64
import functools
from typing import Any

from mbma_tables.export.code.core_code import blocks_of
from mbma_tables.export.code.language import AskedLaw, Beside, Language, Program
from mbma_tables.export.text import number, page_file

# the core's laws, compiled
LAW_MODULE = "law.wasm"


def _places(asked: AskedLaw) -> dict[str, Any]:
    """The module and the blocks of the law, as text."""
    blocks = {}
    for name, block in blocks_of(asked).items():
        blocks[name] = _as_text(block.astype("<f8", copy=False).tobytes())
    return {"wasm": _as_text(page_file(LAW_MODULE)), "blocks": blocks}


def _as_text(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")


PROGRAM = Program(
    "ask.mjs",
    """\
import { readFileSync, writeFileSync } from "node:fs";
{% for law in laws %}
import * as {{ law }} from "./{{ law }}.mjs";
{% endfor %}
const rows = readFileSync("c.txt", "utf8").trim().split("\\n").map(Number).map((c) => [
{% for law, function in asked %}
  {{ law }}.{{ function }}(c),
{% endfor %}
].join(" "));
writeFileSync("values.txt", rows.join("\\n"));
""",
    ("node ask.mjs",),
    ".mjs",
)


LANGUAGES = {
    "javascript-law": Language(
        template="law.mjs",
        evaluator="law.mjs",
        check=("node", "--check", "{file}"),
        mark="/*",
        usage=(
            "import {{ pressure, with_tangent, curvature, area, energy, overclosure }} from "
            "'./{name}.mjs', an ECMAScript module, or require('./{name}.cjs'), the same as a "
            "CommonJS module. The C of the library itself as WebAssembly; {name}.d.mts and "
            "{name}.d.cts have the types for TypeScript. Outside the range a RangeError is "
            "thrown, of what is no number a TypeError."
        ),
        call="{what}({x})",
        program=PROGRAM,
        number=functools.partial(number, infinity="Infinity", missing="NaN"),
        places=_places,
        parts={"export": "export"},
        beside=(
            Beside(".cjs", "law.mjs", parts={"export": "module.exports ="}),
            Beside(".d.mts", "law.d.mts"),
            Beside(".d.cts", "law.d.mts"),
        ),
        output=(
            "an ECMAScript module (call it `NAME.mjs`), the same as a CommonJS module, "
            "`NAME.cjs`, and their types for TypeScript, `NAME.d.mts` and `NAME.d.cts`"
        ),
        outside="a RangeError",
        tested=(
            "node 20.20: the same, opened by `import` and by `require`; TypeScript 5.9 "
            "with `--module node16`"
        ),
    )
}
