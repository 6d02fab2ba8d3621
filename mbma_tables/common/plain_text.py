"""Text of a user or a file as part of a message: nothing in it moves a cursor or begins a line."""


def visible(text: str, keep: str = "") -> str:
    r"""Text in which control characters, line ends and half surrogates are escapes, but for those to keep.

    Examples
    --------
    >>> from mbma_tables.common.plain_text import visible
    >>> visible("a\x1b[2Jb\nµ")
    'a\\x1b[2Jb\\nµ'
    """
    if text.isprintable():
        return text
    escaped = []
    for letter in text:
        if letter.isprintable() or letter in keep:
            escaped.append(letter)
        else:
            escaped.append(letter.encode("unicode_escape").decode("ascii"))
    return "".join(escaped)
