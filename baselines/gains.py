"""Gains that a search on training plants has found, kept in gains.json."""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from drill_env.controllers import Controller

_FILE = Path(__file__).with_name("gains.json")


@dataclass(frozen=True, slots=True)
class Tunable:
    """What a search may choose.

    Args:
        build: makes the controller from a configuration and gains.
        ranges: lowest and highest value of each gain.
    """

    build: Callable[..., Controller]
    ranges: Mapping[str, tuple[float, float]]

    def start(self) -> dict[str, float]:
        """The gains that the controller has by its own rule; where it has none, the middle."""
        defaults = inspect.signature(self.build).parameters
        found: dict[str, float] = {}
        for name, (low, high) in self.ranges.items():
            rule = defaults[name].default if name in defaults else None
            found[name] = rule if isinstance(rule, float) else (low * high) ** 0.5
        return found


@functools.cache
def _kept() -> dict[str, dict[str, dict[str, float]]]:
    return json.loads(_FILE.read_text(encoding="utf-8")) if _FILE.is_file() else {}


def tuned_gains(name: str) -> dict[str, float]:
    """Gains of a controller, empty if none were searched: then its own rule holds."""
    return dict(_kept().get(name, {}).get("gains", {}))
