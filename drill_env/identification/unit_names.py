"""Names for factors by which an angle or a voltage is off."""

from __future__ import annotations

import math

_TURN = 2.0 * math.pi
_ANGLE = {
    "in degrees": (180.0 / math.pi, "deg"),
    "in turns": (1.0 / _TURN, "turn"),
    "in mrad": (1000.0, "mrad"),
    "in counts of an encoder": (8192.0 / _TURN, "counts/N"),
    "decoded four-fold while the counts per turn are those of the lines": (4.0, ""),
    "of an encoder with a fourth of the stated counts per turn": (0.25, ""),
}
_VOLTAGE = {"in mV": (1e-3, "mV"), "in kV": (1e3, "kV")}
_EXACT, _ROUGH = 1.25, 2.2


def named_factor(factor: float, column: str) -> str:
    """What an angle column is in that is `factor` times too large, with the remedy."""
    near = [(n, u) for n, (f, u) in _ANGLE.items() if _distance(f, factor) < math.log(_EXACT)]
    if not near:
        return f"{factor:.4g} times too large: --map {column}={column}:{1.0 / factor:.6g}"
    unit = near[0][1] or f"{1.0 / factor:.6g}"
    return f"{' or '.join(n for n, _ in near)}: --map {column}={column}:{unit}"


def named_common(factor: float) -> str:
    """What could make the response to the voltage `factor` times too large."""
    angle = _near(_ANGLE, factor)
    volts = _near(_VOLTAGE, factor)
    guesses = [f"the angles may be {name}" for name in angle]
    guesses += [f"the voltage may be {name}" for name in volts]
    if not guesses:
        return "another rig, or a wrong unit of u or of both angles: check them"
    units = {unit for unit in angle.values() if unit} | {u for u in volts.values() if u}
    remedy = f"; state the unit with --map ({', '.join(sorted(units))})" if units else ""
    return f"if it is not another rig, {' or '.join(guesses)}{remedy}"


def _near(known: dict[str, tuple[float, str]], factor: float) -> dict[str, str]:
    found = [(n, u, _distance(f, factor)) for n, (f, u) in known.items()]
    return {n: u for n, u, d in sorted(found, key=lambda e: e[2]) if d < math.log(_ROUGH)}


def _distance(known: float, factor: float) -> float:
    return abs(math.log(known / abs(factor)))
