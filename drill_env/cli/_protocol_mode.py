"""The protocol behind `drill-env compare --levels`."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drill_env._errors import InputError
from drill_env.cli._common import print_json, show, tell
from drill_env.cli._engine_options import counted

if TYPE_CHECKING:
    import pandas as pd

    from drill_env._engine import Engine
    from drill_env.benchmark.contestants import Contestant
    from drill_env.benchmark.protocol import Cell, Protocol
    from drill_env.controllers import Controller
    from drill_env.environment.config import EnvConfig


def run_and_report(
    makers: Mapping[str, Callable[[EnvConfig], Controller]],
    config: EnvConfig,
    out: Path,
    *,
    setpoints: Sequence[float] | None,
    levels: Sequence[str],
    starts: Sequence[str],
    engine: Engine,
    extended: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Run what is missing, then write tables and page anew."""
    from drill_env.benchmark.compare import SETPOINTS
    from drill_env.benchmark.contestants import contestant
    from drill_env.benchmark.protocol import EXTENDED_SETPOINTS, Protocol, run_protocol
    from drill_env.report.compare_table import protocol_table

    usual = EXTENDED_SETPOINTS if extended else SETPOINTS
    protocol = Protocol(
        config, tuple(usual if setpoints is None else setpoints), tuple(levels),  # pyright: ignore
        tuple(starts), **options,  # pyright: ignore
    )  # fmt: skip
    contestants = [
        contestant(name, maker, config, _identity(maker)) for name, maker in makers.items()
    ]
    with counted("comparing") as watch:
        files = run_protocol(contestants, protocol, out, engine=engine, progress=watch)
    whole, rows, written = write_protocol(contestants, files, protocol, out)
    if as_json:
        print_json({"files": written, "summary": rows})
        return
    show(protocol_table(whole, protocol.main_start))
    tell("written: " + ", ".join(str(path) for path in written))


def _identity(maker: Any) -> str:
    """What a maker stands for; an agent by its policy's files and the code that runs it."""
    import hashlib

    from drill_env import agents

    folder = getattr(maker, "folder", None)
    if folder is None:
        return repr(maker)
    files = [folder / "agent.json", folder / "policy.npz"]
    files += sorted(Path(agents.__file__).parent.glob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def write_protocol(
    contestants: Sequence[Contestant],
    files: Mapping[Cell, Path],
    protocol: Protocol,
    out: Path,
) -> tuple[pd.DataFrame, list[dict[str, Any]], list[Path]]:
    """Tables, summary.json and page of the cells that were run.

    Returns:
        One row a cell, the rows of summary.json, and the files.
    """
    from drill_env._files import write_text
    from drill_env._tables import write_table
    from drill_env.benchmark.summary import ranking, read_cells, summary_rows
    from drill_env.report.compare_page import save_compare_page

    whole, points = read_cells(files)
    facts = _facts(contestants, protocol)
    tables = {
        "cells.csv": whole, "setpoints.csv": points, "ranking.csv": ranking(whole, protocol),
        "linear_facts.csv": facts,
    }  # fmt: skip
    for name, table in tables.items():
        write_table(table, out / name)
    rows = [
        {
            key: None if isinstance(v, float) and not math.isfinite(v) else v
            for key, v in row.items()
        }
        for row in summary_rows(whole, protocol)
    ]
    write_text(out / "summary.json", json.dumps(rows, indent=2) + "\n")
    save_compare_page(whole, points, facts, files, protocol, out / "index.html")
    return whole, rows, [out / name for name in ("summary.json", "index.html", *tables)]


def _facts(contestants: Sequence[Contestant], protocol: Protocol) -> pd.DataFrame:
    import pandas as pd

    from drill_env.benchmark.linear_facts import design_facts

    found = []
    for item in contestants:
        try:
            table = design_facts(item.maker, protocol.config, protocol.setpoints)
        except InputError:
            # No linear law: learning filters and policies.
            continue
        table.insert(0, "controller", item.name)
        found.append(table)
    return pd.concat(found, ignore_index=True) if found else pd.DataFrame({"controller": []})
