"""Text of a user or a file as part of a message: nothing in it moves a cursor or begins a line."""


def visible(text: str, keep: str = "") -> str:
    r"""Text with control characters, line ends and half surrogates as escapes.

    Those in `keep` stay as they are.

    Examples
    --------
    >>> from mbma_tables.common.plain_text import visible
    >>> visible("a\x1b[2Jb\nµ")
    'a\\x1b[2Jb\\nµ'
    """
    # tables of many lines are printable but for their line ends
    if all(letter in keep for letter in set(text) if not letter.isprintable()):
        return text
    escaped = []
    for letter in text:
        if letter.isprintable() or letter in keep:
            escaped.append(letter)
        else:
            escaped.append(letter.encode("unicode_escape").decode("ascii"))
    return "".join(escaped)
