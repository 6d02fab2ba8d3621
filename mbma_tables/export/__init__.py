"""The model, its tables and its laws written for other programs."""


def __getattr__(name: str) -> tuple[str, ...]:
    """Names of the targets of a group: SOLVERS, DATA, LAWS, FMUS, CODE."""
    from mbma_tables.export.registry import GROUPS, targets

    if name not in GROUPS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return tuple(targets(name))
