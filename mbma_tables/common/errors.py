"""The errors of this library, each a subclass of `MbmaError`."""

from typing import Any

from mbma_tables.common.plain_text import visible


class MbmaError(Exception):
    """Base of every error that this library raises on purpose.

    Its message may quote a user's text, such as the name of a file: control characters are
    escapes in it.
    """

    def __init__(self, message: object = "") -> None:
        super().__init__(visible(str(message), keep="\n"))


class InputError(MbmaError, ValueError):
    """An argument that has no meaning here: NaN, a wrong sign, a wrong shape, an unknown name."""


class OutOfRangeError(InputError):
    """Numbers outside the covered range.

    Attributes
    ----------
    mask : numpy.ndarray of bool
        True where the entry is out of range, in the shape of the broadcast arguments.

    Examples
    --------
    >>> from mbma_tables import OutOfRangeError, Surface
    >>> try:
    ...     Surface(hurst=[0.5, 1.5], q0=0.5, q1=100.0, h_rms=0.2, h_max=0.6)
    ... except OutOfRangeError as error:
    ...     print(error, error.mask)
    hurst must be in (0, 1], got 1.5 at (1,) [False  True]
    """

    def __init__(self, message: str, mask: Any = None) -> None:
        super().__init__(message)
        self.mask = mask


class MissingError(InputError, AttributeError):
    """A quantity that a contact does not have, since what it needs was not given.

    It is an `AttributeError`, so that ``hasattr(contact, "solid_conductance")`` and
    ``getattr(contact, "energy", None)`` answer as Python's protocols want it.
    """


class ConvergenceError(MbmaError, ArithmeticError):
    """An iteration that did not reach its tolerance.

    Attributes
    ----------
    mask : numpy.ndarray of bool
        True where it failed, in the shape of the broadcast arguments.
    result : object
        The unconverged result, for inspection; entries under `mask` are not valid.
    """

    def __init__(self, message: str, mask: Any = None, result: Any = None) -> None:
        super().__init__(message)
        self.mask = mask
        self.result = result


class NotSelfAffineError(MbmaError, ValueError):
    """A measured map or spectrum that is not a self-affine surface; the message has the reason."""


class UncertifiedError(MbmaError):
    """A table that broke a physical check or missed its target, or a function for which the target cannot be reached."""


class TableFileError(MbmaError, OSError):
    """A table file that cannot be used: unreadable, damaged, edited, of another format or kind."""
