"""The ONNX graph of an agent with both encoders."""

from __future__ import annotations

from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from drill_env._types import FloatArray

from . import features as f
from .policy import Agent

_OPSET, _IR = 17, 9
_COLUMNS = (("observation", 3, 4), ("memory", 0, 1), ("memory", 1, 2))


class _Graph:
    """Nodes and constants under way."""

    def __init__(self) -> None:
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def constant(self, value: Any, kind: type = np.float64) -> str:
        name = f"c{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(value, dtype=kind), name))
        return name

    def __call__(self, kind: str, *inputs: Any, to: str | None = None, **attributes: Any) -> str:
        """Add a node; inputs that are no names become constants."""
        names = [x if isinstance(x, str) else self.constant(x) for x in inputs]
        out = to or f"n{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, names, [out], **attributes))
        return out

    def columns(self, source: str, first: int, last: int) -> str:
        """Columns first..last-1."""
        ends = [self.constant([v], np.int64) for v in (first, last, 1)]
        return self("Slice", source, *ends)

    def line(self, x: str, scale: Any) -> str:
        """A straight line over the set point."""
        start = float(scale(np.array(0.0)))
        return self("Add", self("Mul", x, float(scale(np.array(1.0))) - start), start)

    def clip(self, x: str, bound: str, to: str | None = None) -> str:
        """`x` within +- `bound`, both of the same shape."""
        return self("Max", self("Min", x, bound), self("Neg", bound), to=to)

    def interpolate(self, x: str, points: FloatArray, values: FloatArray) -> str:
        """As numpy.interp for a column: a sum of hinges."""
        slopes = np.diff(values) / np.diff(points)
        turns = np.diff(np.concatenate([[0.0], slopes, [0.0]]))
        hinges = self("Max", self("Sub", x, points[None, :]), 0.0)
        return self("Add", self("MatMul", hinges, turns[:, None]), values[0])

    def asinh(self, x: str) -> str:
        """In double precision, which the operator of that name often lacks."""
        size = self("Abs", x)
        root = self("Sqrt", self("Add", self("Mul", size, size), 1.0))
        return self("Mul", self("Sign", x), self("Log", self("Add", size, root)))


def agent_graph(agent: Agent, features: f.BothEncoders) -> onnx.ModelProto:
    """The whole agent; the memory goes in and comes out."""
    g, count = _Graph(), 5 + 4 * features.history
    s, trim, lean = (g.columns(*of) for of in _COLUMNS)
    points, volts, twist = features.table.T
    steady = g.interpolate(s, points, volts)
    push, reach = g.line(s, f.push_scale), g.line(s, f.trim_range)
    reference = g.interpolate(s, points, twist)
    middle = g("Concat", reference, s, s, steady, axis=1)
    per = g("Reciprocal", g("Concat", s, s, s, push, axis=1))
    per = g("Mul", per, np.array([[f.PULSE, 1.0, 1.0, 1.0]]))
    frames = [g("Concat", g.columns("observation", 0, 3), g.columns("observation", 4, 5), axis=1)]
    frames += [g.columns("observation", k, k + 4) for k in range(5, count, 4)]
    parts = [g.asinh(g("Mul", g("Sub", frame, middle), per)) for frame in frames]
    plain = g("Div", g.columns("observation", 0, 5), np.array([f.SCALES]))
    parts.append(g("Sub", plain, np.array([[0.0, 0.0, 0.0, 1.0, 0.0]])))
    parts += [g("Sub", g("Log", s), f.LOG_MIDDLE), g("Div", trim, reach)]
    beyond = g("Sub", g.columns("observation", 0, 1), reference)
    swing = g("Sub", beyond, lean)
    parts.append(g.asinh(g("Mul", swing, g.columns(per, 0, 1))))
    x = g("Concat", *parts, axis=1)
    for k, (w, b) in enumerate(zip(agent.network.weights, agent.network.biases, strict=True)):
        x = g("Add", g("MatMul", x, w), b[None, :])
        x = x if k == len(agent.network.weights) - 1 else g("Tanh", x)
    base = g("Add", steady, trim)
    wanted = g("Add", base, g("Mul", push, g.clip(x, g.constant([[f.OUTPUT_BOUND]]))))
    chosen = g.clip(wanted, g.constant([[features.limit]]), to="volts")
    share = features.period / f.MEAN_TIME
    moved = g("Add", trim, g("Mul", g("Sub", chosen, base), share))
    leaning = g("Add", lean, g("Mul", swing, share))
    g("Concat", g.clip(moved, reach), leaning, to="next_memory", axis=1)
    return _model(g, count)


def _model(g: _Graph, count: int) -> onnx.ModelProto:
    def value(name: str, width: int) -> Any:
        return helper.make_tensor_value_info(name, TensorProto.DOUBLE, ["n", width])

    graph = helper.make_graph(
        g.nodes, "agent", [value("observation", count), value("memory", 2)],
        [value("volts", 1), value("next_memory", 2)], g.constants,
    )  # fmt: skip
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", _OPSET)], ir_version=_IR)
