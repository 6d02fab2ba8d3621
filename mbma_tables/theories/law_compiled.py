"""A contact law as an argument of functions that numba compiles."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import (
    NativeValue,
    make_attribute_wrapper,
    models,
    overload_method,
    register_model,
    typeof_impl,
    unbox,
)

from mbma_tables.arguments import FloatArray
from mbma_tables.theories.law_kernel import AREA, AREA_SLOPE, ENERGY, FORCE, FORCE_SLOPE, evaluate


@dataclasses.dataclass(frozen=True, eq=False)
class CompiledLaw:
    """A law for functions that numba compiles: pass it as an argument, and ask it for numbers at a separation d.

    Methods `force` (F/A0), `area` (A/A0), `stiffness` (-dF/du), `area_slope` (-d(A/A0)/dd) and `energy` (the integral
    of force over u, to last contact). NaN outside the law.
    """

    block: FloatArray

    def _at(self, what: int, factor: float, d: float) -> float:
        return factor * evaluate(what, self.block.ctypes.data, d)


class _LawType(types.Type):
    """Type of `CompiledLaw` in compiled code: its own, as methods of a named tuple would hide fields of all others."""

    def __init__(self) -> None:
        super().__init__(name="CompiledLaw")


_LAW, _BLOCK = _LawType(), types.Array(types.float64, 1, "C")


@typeof_impl.register(CompiledLaw)
def _typeof(law: Any, context: Any) -> Any:
    return _LAW


@register_model(_LawType)
class _LawModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("block", _BLOCK)])  # type: ignore[no-untyped-call]


make_attribute_wrapper(_LawType, "block", "block")


@unbox(_LawType)
def _unbox(kind: Any, law: Any, context: Any) -> Any:
    block = context.pyapi.object_getattr_string(law, "block")
    native = context.unbox(_BLOCK, block)
    context.pyapi.decref(block)
    proxy = cgutils.create_struct_proxy(kind)(context.context, context.builder)
    proxy.block = native.value
    return NativeValue(proxy._getvalue(), is_error=native.is_error, cleanup=native.cleanup)


def _offer(name: str, what: int, factor: float = 1.0) -> None:
    """A method of `CompiledLaw`, in Python and in compiled code."""
    setattr(CompiledLaw, name, functools.partialmethod(CompiledLaw._at, what, factor))

    @overload_method(_LawType, name)
    def offered(law, d):  # type: ignore[no-untyped-def]
        return lambda law, d: factor * evaluate(what, np.int64(law.block.ctypes.data), d)  # type: ignore[arg-type]


_offer("force", FORCE)
_offer("area", AREA)
_offer("stiffness", FORCE_SLOPE, 2.0)
_offer("area_slope", AREA_SLOPE)
_offer("energy", ENERGY, 0.5)
