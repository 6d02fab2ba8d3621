"""What the pages of the docs share: figures as bytes, files written whole."""

from __future__ import annotations

import io
from typing import Any


def png(figure: Any, **options: Any) -> bytes:
    """A pyplot figure as the content of a PNG file, the same bytes for the same figure; closes it."""
    from matplotlib import pyplot

    content = io.BytesIO()
    figure.savefig(content, format="png", metadata={"Software": None}, pil_kwargs={"optimize": True}, **options)
    pyplot.close(figure)
    return content.getvalue()
