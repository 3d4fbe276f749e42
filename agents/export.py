"""Policies for other programs: one C header without dependencies, or an ONNX graph.

`python -m drill_env.agents.export encoders-ppo out/agent.h`, or `out/agent.onnx`.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from drill_env._errors import InputError
from drill_env._files import replacing, write_text
from drill_env._types import FloatArray, PathLike
from drill_env.sensors import Encoder

from . import features as f
from .policy import SHIPPED, Agent, load

# Not by __file__ or argv[0]: `python -m` leaves them empty under an aliased package.
_TEMPLATE = SHIPPED.with_name("agent.h.jinja")


def _exportable(agent: Agent) -> f.BothEncoders:
    if isinstance(agent.features, f.BothEncoders):
        return agent.features
    raise InputError(
        "this agent reads the estimates of an extended Kalman filter, which is not exported: "
        "export an agent with both encoders"
    )


def _numbers(values: FloatArray, digits: int) -> str:
    return "{" + ", ".join(f"{v:.{digits}g}" for v in values.tolist()) + "}"


def _floats(values: FloatArray) -> str:
    # A decimal point makes them literals of type float.
    return "{" + ", ".join(f"{v:.9e}f" for v in values.tolist()) + "}"


def _rows(values: FloatArray, write: Any) -> str:
    return ",\n".join("    " + write(row) for row in values)


def _line(scale: Any) -> tuple[float, float]:
    """Offset and slope of a straight line over the set point."""
    at_zero, at_one = (float(scale(np.array(x))) for x in (0.0, 1.0))
    return at_zero, at_one - at_zero


def c_source(agent: Agent, name: str) -> str:
    """A C header with the whole agent: history, features, network and means.

    Args:
        agent: one with both encoders.
        name: stem of the C names.

    Raises:
        InputError: the agent reads a filter's estimates, or the name is none in C.
    """
    features, encoder = _exportable(agent), Encoder()
    symbol = re.sub(r"[^0-9a-zA-Z]", "_", name)
    if not re.match(r"[a-zA-Z]", symbol):
        raise InputError(f"name {name!r}: begin with a letter")
    network = agent.network
    layers = [
        {
            "inputs": w.shape[0], "outputs": w.shape[1], "weights": _rows(w, _floats),
            "biases": _floats(b),
        }
        for w, b in zip(network.weights, network.biases, strict=True)
    ]  # fmt: skip
    environment = jinja2.Environment(
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, autoescape=False
    )
    template = environment.from_string(_TEMPLATE.read_text(encoding="utf-8"))
    return template.render(
        name=name, symbol=symbol, period=features.period, rate=f"{encoder.rate_hz:g}",
        cutoff=f"{encoder.cutoff_hz:g}", digest=agent.setting.get("policy_sha256", "unknown"),
        frames=1 + features.history, knots=len(features.table), layers=layers,
        table=_rows(features.table, lambda row: _numbers(row, 17)),
        push=_line(f.push_scale), range=_line(f.trim_range), pulse=f.PULSE, scales=f.SCALES,
        log_middle=f.LOG_MIDDLE, bound=f.OUTPUT_BOUND, limit=features.limit,
        share=features.period / f.MEAN_TIME,
        widest=max(features.size, *(w.shape[1] for w in network.weights)),
    )  # fmt: skip


def to_c(agent: Agent, path: PathLike) -> None:
    """Write `c_source`; its names begin with the file's stem."""
    write_text(Path(path), c_source(agent, Path(path).stem))


def to_onnx(agent: Agent, path: PathLike) -> None:
    """Write the agent as an ONNX graph in double precision.

    Inputs ``observation`` (n, d), in physical units, and ``memory`` (n, 2), zero at the start;
    outputs ``volts`` (n, 1) and ``next_memory`` (n, 2), to be handed in again.

    Raises:
        InputError: the extra ``export`` is not installed, or the agent reads a filter's
            estimates.
    """
    features = _exportable(agent)
    try:
        import onnx
    except ImportError as error:
        raise InputError("ONNX needs a package: pip install 'drill-env[export]'") from error
    from ._onnx_graph import agent_graph

    model = agent_graph(agent, features)
    onnx.checker.check_model(model)
    with replacing(Path(path)) as temporary:
        temporary.write_bytes(model.SerializeToString())


def main() -> None:
    """Export by the file's ending."""
    parser = argparse.ArgumentParser(
        prog="python -m drill_env.agents.export", description="Export an agent to C or ONNX."
    )
    parser.add_argument("agent", help="name of a shipped agent, or a folder written by train.py")
    parser.add_argument("out", type=Path, help="file that ends in .h or .onnx")
    options = parser.parse_args()
    writers = {".h": to_c, ".onnx": to_onnx}
    if options.out.suffix not in writers:
        raise InputError(f"output {options.out}: give a name that ends in .h or .onnx")
    writers[options.out.suffix](load(options.agent), options.out)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
