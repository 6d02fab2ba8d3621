"""What the pages of the docs share: figures as bytes, and measured parts between marks in written text."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable, Collection, Mapping
from typing import Any

import click

MARKED = re.compile(r"(<!-- measured: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def fill(text: str, blocks: Mapping[str, Callable[[], str]], left: Collection[str] = ()) -> str:
    """A page's text with its measured parts made anew, but those `left`; marks and parts must be the same."""
    found = [match[2] for match in MARKED.finditer(text) if match[2] not in left]
    if sorted(found) != sorted(blocks):
        raise click.ClickException(f"the page marks {json.dumps(found)}, not {json.dumps(sorted(blocks))}")

    def made(match: re.Match[str]) -> str:
        return match[0] if match[2] in left else f"{match[1]}\n{blocks[match[2]]()}\n\n{match[3]}"

    return MARKED.sub(made, text)


def png(figure: Any, **options: Any) -> bytes:
    """A pyplot figure as the content of a PNG file, the same bytes for the same figure; closes it."""
    from matplotlib import pyplot

    content = io.BytesIO()
    figure.savefig(content, format="png", metadata={"Software": None}, pil_kwargs={"optimize": True}, **options)
    pyplot.close(figure)
    return content.getvalue()
