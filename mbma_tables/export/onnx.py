"""A contact law as a graph of ONNX in float64, for batches in other languages: a trace of the law in Python."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbma_tables import __version__
from mbma_tables.common.arguments import needed
from mbma_tables.export.law_code import MAX_NAME, asked_law, text_of
from mbma_tables.export.targets import CODE, Target
from mbma_tables.export.text import checked_name
from mbma_tables.surfaces.any_surface import AnySurface

OPSET, IR = 17, 8  # of 2022: what readers of that year and later know
INT64 = 7  # of ONNX
QUANTITIES = ("pressure", "tangent", "area", "energy")
OPERATORS = {"add": "Add", "sub": "Sub", "mul": "Mul", "truediv": "Div", "pow": "Pow", "and": "And"}
COMPARISONS = {"lt": "Less", "le": "LessOrEqual", "gt": "Greater", "ge": "GreaterOrEqual", "eq": "Equal"}


class _Value:
    """A value of the graph: operators add nodes to it. Of rows of polynomials it has the number of columns."""

    __array_ufunc__ = None  # arrays leave operators to it

    def __init__(self, graph: _Graph, name: str, kind: type, width: int) -> None:
        self.graph, self.name, self.kind, self.shape = graph, name, kind, (width,)

    def __getitem__(self, key: Any) -> _Value:
        if isinstance(key, _Value):
            return self.graph("Gather", self, key)
        if key[1] is None:
            return self.graph("Unsqueeze", self, np.array([-1]))
        if isinstance(key[1], int):
            return self.graph("Gather", self, np.array(key[1]), axis=-1)
        return self.graph("Gather", self, np.arange(self.shape[0])[key[1]], axis=-1)


def _operator(name: str, reflected: bool, kind: type | None) -> Any:
    def apply(self: _Value, other: Any) -> _Value:
        given: Any = other if isinstance(other, _Value) else np.asarray(other, self.kind)
        return self.graph(name, *((given, self) if reflected else (self, given)), kind=kind or self.kind)

    return apply


for _name, _operation in OPERATORS.items():
    setattr(_Value, f"__{_name}__", _operator(_operation, False, None))
    setattr(_Value, f"__r{_name}__", _operator(_operation, True, None))
for _name, _operation in COMPARISONS.items():
    setattr(_Value, f"__{_name}__", _operator(_operation, False, bool))


class _Graph:
    """A graph under construction, which the law in Python takes for its module of arrays."""

    nan, inf = np.nan, np.inf
    arange = staticmethod(np.arange)

    def __init__(self, helper: Any) -> None:
        self.helper = helper
        self.nodes: dict[tuple[Any, ...], Any] = {}
        self.constants: dict[tuple[str, bytes], tuple[str, Any]] = {}

    def __call__(self, operator: str, *inputs: Any, name: str = "", kind: type = float, **attributes: Any) -> _Value:
        values = [given if isinstance(given, _Value) else self.array(given) for given in inputs]
        names = [value.name for value in values]
        # what is asked twice is computed once
        key = (operator, *names, name, *attributes.items())
        if key not in self.nodes:
            self.nodes[key] = self.helper.make_node(operator, names, [name or f"v{len(self.nodes)}"], **attributes)
        # rows gathered along their columns have as many as are asked for
        asked = values[1].shape[0] if attributes.get("axis") == -1 else max(value.shape[0] for value in values)
        return _Value(self, self.nodes[key].output[0], kind, asked)

    def array(self, given: Any) -> _Value:
        value = np.asarray(given)
        name, _ = self.constants.setdefault(
            (f"{value.dtype}{value.shape}", value.tobytes()), (f"k{len(self.constants)}", value)
        )
        return _Value(self, name, float, value.shape[-1] if value.ndim else 1)

    def asarray(self, given: _Value, kind: type) -> _Value:
        return given

    def where(self, mask: Any, first: Any, second: Any) -> _Value:
        return self("Where", mask, first, second)

    def searchsorted(self, edges: _Value, x: _Value, side: str) -> _Value:
        reached = self("Cast", self("GreaterOrEqual", x[..., None], edges), to=INT64)
        found = self("ReduceSum", reached, np.array([-1]), keepdims=0, kind=int)
        return _Value(self, found.name, int, 1)


def onnx(surface: AnySurface, E_star: float | str, *, name: str = "law", **asked: Any) -> bytes:
    """A contact law as a file of ONNX: overclosure of shape (n,) in; pressure, tangent, area and energy out.

    Outside the range answers are NaN. Everything is float64. Runtimes refuse float32 and other shapes, which the
    checker of ONNX does not let a graph leave open: convert arrays, and ravel them, before.

    Parameters
    ----------
    surface, E_star, name, **asked
        As for `law_text`; a conductivity adds the output conductance, leakage the output leakage.

    Returns
    -------
    bytes
        The file.

    Raises
    ------
    InputError, OutOfRangeError, MbmaError
        As `law_text`; MbmaError without the package onnx.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> import onnx as library
    >>> file = onnx(Surface.named("concrete"), "13.3 MPa", theory="calibrated")
    >>> [output.name for output in library.load_from_string(file).graph.output]
    ['pressure', 'tangent', 'area', 'energy']
    """
    library = needed("onnx", "onnx")
    helper, double = library.helper, library.TensorProto.DOUBLE
    found, graph = asked_law(surface, E_star, **asked), _Graph(helper)
    text = text_of("jax-law", checked_name(name, MAX_NAME), found).replace("import jax\nimport jax.numpy as jnp\n", "")
    law: dict[str, Any] = {"jnp": graph}
    exec(text, law)
    c, outputs = _Value(graph, "overclosure", float, 1), [*QUANTITIES, *found.more]
    for output in outputs:
        graph("Identity", law[output](c), name=output)
    made = helper.make_graph(
        list(graph.nodes.values()),
        name,
        [helper.make_tensor_value_info("overclosure", double, ["n"])],
        [helper.make_tensor_value_info(output, double, ["n"]) for output in outputs],
        [library.numpy_helper.from_array(value, key) for key, value in graph.constants.values()],
        doc_string="\n".join((*found.said, "in and out: float64 of shape (n,); convert float32 and ravel before")),
    )
    known = {"opset_imports": [helper.make_opsetid("", OPSET)], "ir_version": IR}
    model = helper.make_model(made, producer_name="mbma_tables", producer_version=__version__, **known)
    return bytes(model.SerializeToString(deterministic=True))


TARGETS = (Target("onnx", onnx, CODE, rows=False),)
