"""Runs the code blocks of the README, each alone in an empty folder.

A block that cannot run there says so in the line before it: `<!-- not run: reason -->`.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "README.md"
BLOCK = re.compile(
    r"^(?:<!-- not run: (?P<reason>.+?) -->\n+)?```(?P<language>\w*)\n(?P<code>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
COMMANDS = {"bash": ["bash", "-euo", "pipefail"], "python": [sys.executable]}
SHOWN_ONLY = {"toml", "text", "csv"}


@dataclass(frozen=True)
class Block:
    language: str
    code: str
    reason: str | None
    line: int


def blocks(text: str) -> list[Block]:
    return [
        Block(m["language"], m["code"], m["reason"], text.count("\n", 0, m.start("code")))
        for m in BLOCK.finditer(text)
    ]


FOUND = blocks(README.read_text(encoding="utf-8"))
RUN = [b for b in FOUND if b.language in COMMANDS and b.reason is None]


@pytest.mark.slow
@pytest.mark.parametrize("block", RUN, ids=lambda b: f"{b.language}-line-{b.line}")
def test_readme_block_runs(block, tmp_path):
    source = tmp_path / ("block.py" if block.language == "python" else "block.sh")
    source.write_text(block.code)
    folder = tmp_path / "empty"
    folder.mkdir()
    if (ROOT / "train.py").exists():
        shutil.copy(ROOT / "train.py", folder)
    binaries = str(Path(sys.executable).parent)
    environment = {
        **os.environ,
        "PATH": os.pathsep.join([binaries, os.environ["PATH"]]),
        "PYTHONPATH": str(ROOT),
        "MPLBACKEND": "Agg",
        "SDL_VIDEODRIVER": "dummy",
    }
    done = subprocess.run(
        [*COMMANDS[block.language], str(source)],
        cwd=folder, env=environment, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"README line {block.line}:\n{done.stdout}\n{done.stderr}"


def test_every_block_of_the_readme_is_known():
    text = README.read_text(encoding="utf-8")
    assert len(FOUND) * 2 == len(re.findall(r"^```", text, re.MULTILINE))
    assert {b.language for b in FOUND} <= set(COMMANDS) | SHOWN_ONLY
    assert RUN


def test_blocks_are_found_and_left_out_as_marked():
    fence = "```"
    text = (
        f"a\n{fence}bash\ntrue\n{fence}\n"
        f"<!-- not run: needs a rig -->\n{fence}python\nx\n{fence}\n"
        f"<!-- another comment -->\n{fence}python\ny = 1\n{fence}\n"
    )
    found = blocks(text)
    assert [(b.language, b.reason) for b in found] == [
        ("bash", None),
        ("python", "needs a rig"),
        ("python", None),
    ]
    assert found[0].line == 2 and found[2].code == "y = 1\n"
