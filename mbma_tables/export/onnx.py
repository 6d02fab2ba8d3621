"""A contact law as a graph of ONNX in float64, for batches in other languages."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder

from mbma_tables import __version__
from mbma_tables.common.arguments import FloatArray, needed
from mbma_tables.export.law_code import MAX_NAME, AskedLaw, asked_law
from mbma_tables.export.law_numbers import FlowNumbers, LawNumbers
from mbma_tables.export.targets import CODE, Target
from mbma_tables.export.text import checked_name
from mbma_tables.surfaces.any_surface import AnySurface

OPSET, IR = 17, 8  # of 2022: what readers of that year and later know


class _Graph:
    """A graph under construction: nodes by their operator, which return the name of what they compute."""

    def __init__(self, helper: Any) -> None:
        self.helper = helper
        self.nodes: list[Any] = []
        self.constants: dict[str, np.ndarray[Any, Any]] = {}

    def __call__(self, operator: str, *inputs: Any, name: str = "", **attributes: Any) -> str:
        name = name or f"v{len(self.nodes)}"
        named = [given if isinstance(given, str) else self._constant(given) for given in inputs]
        self.nodes.append(self.helper.make_node(operator, named, [name], **attributes))
        return name

    def _constant(self, value: Any) -> str:
        self.constants[f"k{len(self.constants)}"] = np.asarray(value)
        return f"k{len(self.constants) - 1}"


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
    outputs = _law(graph, found)
    made = helper.make_graph(
        graph.nodes,
        checked_name(name, MAX_NAME),
        [helper.make_tensor_value_info("overclosure", double, ["n"])],
        [helper.make_tensor_value_info(output, double, ["n"]) for output in outputs],
        [library.numpy_helper.from_array(value, key) for key, value in graph.constants.items()],
        doc_string="\n".join((*found.said, "in and out: float64 of shape (n,); convert float32 and ravel before")),
    )
    known = {"opset_imports": [helper.make_opsetid("", OPSET)], "ir_version": IR}
    model = helper.make_model(made, producer_name="mbma_tables", producer_version=__version__, **known)
    return bytes(model.SerializeToString(deterministic=True))


def _law(graph: _Graph, found: AskedLaw) -> list[str]:
    """Nodes from overclosure to the quantities of a law, as `law_numbers` describes it."""
    c, numbers = "overclosure", found.numbers
    k = _record(graph, graph("Mul", c, numbers.scale), numbers.edges)
    near = graph("Less", k, numbers.side)
    x = graph("Mul", graph("Where", near, c, graph("Sub", c, numbers.h_max)), numbers.scale)
    rate = graph("Gather", numbers.rate, k)
    t = graph("Mul", graph("Sub", x, graph("Gather", numbers.centre, k)), rate)
    rate = graph("Mul", rate, numbers.scale)
    powered = graph("And", graph("Equal", k, 0), bool(numbers.ends))
    base = graph("Where", powered, t, 1.0)
    below = graph("And", graph("LessOrEqual", c, 0.0), bool(numbers.ends))
    above = graph("GreaterOrEqual", c, numbers.c_least)
    outside = graph("Not", graph("And", above, graph("LessOrEqual", c, numbers.c_most)))

    def ended(value: str, to: str) -> str:
        return graph("Where", outside, np.nan, graph("Where", below, 0.0, value), name=to)

    value = _polynomial(graph, numbers.force, k, t)
    slope = _polynomial(graph, np.asarray(polyder(numbers.force, axis=1), float), k, t)
    power = graph("Where", powered, graph("Div", numbers.power_p, base), 0.0)
    lead = graph("Pow", base, numbers.power_p)
    slope = graph("Mul", lead, graph("Add", slope, graph("Mul", power, value)))
    area = graph("Mul", graph("Pow", base, numbers.power_a), _polynomial(graph, numbers.area, k, t))
    powers = np.tile(np.arange(1.0, 10.0), (numbers.rate.size, 1))
    powers[0] += numbers.power_p
    sum_ = graph("Mul", graph("Mul", lead, t), _polynomial(graph, numbers.force / powers, k, t))
    energy = graph("Add", graph("Gather", numbers.energies, k), graph("Div", sum_, rate))
    outputs = [
        ended(graph("Mul", lead, value), "pressure"),
        ended(graph("Mul", slope, rate), "tangent"),
        ended(area, "area"),
        ended(energy, "energy"),
    ]
    if "conductance" in found.more:
        outputs.append(graph("Mul", "tangent", found.ratio, name="conductance"))
    if found.flow:
        outputs.append(graph("Where", outside, np.nan, _flow(graph, numbers, found.flow), name="leakage"))
    return outputs


def _flow(graph: _Graph, numbers: LawNumbers, flow: FlowNumbers) -> str:
    """Nodes from overclosure to the flow coefficient within the law's range."""
    c = "overclosure"
    d = graph("Sub", numbers.h_max, graph("Mul", c, 2.0))
    x = graph("Mul", graph("Sub", d, flow.blocked), flow.scale)
    k = _record(graph, x, flow.edges)
    t = graph("Mul", graph("Sub", x, graph("Gather", flow.centre, k)), graph("Gather", flow.rate, k))
    blocked = graph("And", graph("LessOrEqual", x, 0.0), flow.power > 0)
    base = graph("Where", graph("And", graph("Equal", k, 0), graph("Not", blocked)), t, 1.0)
    value = graph("Mul", graph("Pow", base, flow.power), _polynomial(graph, flow.force, k, t))
    u = graph("Sub", numbers.h_max, c)
    wide = graph("Div", -1.5, graph("Add", graph("Pow", graph("Div", u, flow.h_rms), 2.0), 4.0))
    apart = graph("Mul", graph("Pow", u, 3.0), graph("Add", wide, 1.0))
    value = graph("Where", graph("And", graph("Less", c, 0.0), numbers.ends), apart, value)
    return graph("Where", blocked, 0.0, value)


def _record(graph: _Graph, x: str, edges: FloatArray) -> str:
    """The number of edges reached."""
    reached = graph("GreaterOrEqual", graph("Unsqueeze", x, [-1]), edges)
    return graph("ReduceSum", graph("Cast", reached, to=7), [-1], keepdims=0)


def _polynomial(graph: _Graph, rows: FloatArray, k: str, t: str) -> str:
    """The polynomial of row k."""
    powers = graph("Pow", graph("Unsqueeze", t, [-1]), np.arange(float(rows.shape[1])))
    return graph("ReduceSum", graph("Mul", graph("Gather", rows.copy(), k), powers), [-1], keepdims=0)


TARGETS = (Target("onnx", onnx, CODE, rows=False),)
