"""Where a mismatch sits: component, coordinate, times and size."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.result import FoundShape, Located
from drill_env.diagnosis.shapes import COORDINATES, TURN, comes_round
from drill_env.diagnosis.strikes import Strike, outline
from drill_env.diagnosis.terms import Shape, Term
from drill_env.diagnosis.waves import Wave, formula_of, one_period

_SHORTEST = 0.05
_JOINED = 0.25
_MOST_INTERVALS = 12
_MOST_ORDER = 8
# Values in which one period of a wave is told.
_DRAWN = 32
# A region that is wider tells nothing.
_MOST_OF_A_TURN = 0.8


def locate(setting: Setting, fit: Fit, term: Term) -> Located:
    """Where a term of a fit acts."""
    responses = [term.source.response(term.q, fit.rig, m) for m in fit.motions]
    torque = np.concatenate([r[0] for r in responses])
    error = np.concatenate([r[1] for r in responses])
    sizes = [np.abs(a).sum(axis=1) for a in _acting(responses)]
    most = int(np.argmax([float(np.sum(s**2)) for s in sizes]))
    motion = fit.motions[most]
    strong = sizes[most] > 0.5 * sizes[most].max()
    component, equation, depends_on = _where(term)
    return Located(
        component, equation, depends_on,
        label_of(setting, most),
        _intervals(motion.t, strong),
        _region(depends_on, fit, strong, most),
        _order(term), _frequency(term),
        {"upper": _rms(torque[:, 0]), "lower": _rms(torque[:, 1])},
        {"upper": _rms(error[:, 0]), "lower": _rms(error[:, 1])},
    )  # fmt: skip


def label_of(setting: Setting, place: int) -> str:
    """Name of a fitted recording's file, with its folder where others have the same name."""
    sources = [s.recording.source for s in setting.samples]
    names = [Path(source).name for source in sources]
    return names[place] if names.count(names[place]) == 1 else sources[place]


def _acting(responses: Sequence[tuple[FloatArray, FloatArray]]) -> list[FloatArray]:
    senses = all(not np.any(torque) for torque, _ in responses)
    return [error if senses else torque for torque, error in responses]


def _where(term: Term) -> tuple[str, str, str]:
    source = term.source
    if isinstance(source, Shape):
        equation = {"actuator": "upper", "upper": "upper", "lower": "lower", "string": "both"}.get(
            source.component, "upper" if source.id.startswith("error_u") else "lower"
        )
        return source.component, equation, source.depends_on
    effect = source.effect
    return effect.component, effect.equation, effect.depends_on


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _intervals(t: FloatArray, strong: np.ndarray) -> list[list[float]]:
    """Longest stretches in which a flag is set, short breaks bridged."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], strong, [False]]).astype(int)))
    pairs = [[float(t[a]), float(t[b - 1])] for a, b in zip(edges[::2], edges[1::2], strict=True)]
    joined: list[list[float]] = []
    for start, stop in pairs:
        if joined and start - joined[-1][1] < _JOINED:
            joined[-1][1] = stop
        else:
            joined.append([start, stop])
    joined = [p for p in joined if p[1] - p[0] >= _SHORTEST] or joined
    longest = sorted(joined, key=lambda p: p[0] - p[1])[:_MOST_INTERVALS]
    return sorted([round(a, 3), round(b, 3)] for a, b in longest)


def _region(depends_on: str, fit: Fit, strong: np.ndarray, place: int) -> dict[str, list[float]]:
    coordinate = COORDINATES.get(depends_on)
    if coordinate is None or not strong.any():
        return {}
    values = coordinate(fit.motions[place])[strong]
    if depends_on.startswith("theta"):
        values = np.mod(values, TURN)
        if np.ptp(values) > _MOST_OF_A_TURN * TURN:
            return {}
    return {depends_on: [float(np.quantile(values, 0.02)), float(np.quantile(values, 0.98))]}


def _order(term: Term) -> float | None:
    source = term.source
    if isinstance(source, Shape):
        if not comes_round(source.depends_on, source.knots):
            return None
        power = np.abs(np.fft.rfft(term.q - np.mean(term.q)))[1 : _MOST_ORDER + 1]
        return float(1 + np.argmax(power))
    effect = source.effect
    for p, value in zip(effect.parameters, term.q.tolist(), strict=True):
        if p.name == "order":
            return value
    periodic = effect.depends_on.startswith("theta") and any(
        p.role == "phase" for p in effect.parameters
    )
    return 1.0 if periodic else None


def _frequency(term: Term) -> float | None:
    if isinstance(term.source, Shape) or term.source.effect.depends_on != "time":
        return None
    for p, value in zip(term.source.effect.parameters, term.q.tolist(), strict=True):
        if p.name == "frequency":
            return value
    return None


def describe(term: Term) -> FoundShape | None:
    """A free shape with the shortest formula that explains most of it."""
    if isinstance(term.source, Wave):
        x, y = one_period(term, _DRAWN)
        along = term.source.effect.depends_on
        return FoundShape(along, "torque", formula_of(term), 1.0, x.tolist(), y.tolist())
    if not isinstance(term.source, Shape) or isinstance(term.source, LostCounts):
        return None
    if isinstance(term.source, Strike):
        return _struck(term.source, term.q)
    x, y = np.array(term.source.knots), term.q
    best = ("constant", 0.0)
    name = term.source.depends_on
    for formula, value in _formulas(name, x, y, comes_round(name, term.source.knots)):
        # A longer formula must earn a tenth of what is left.
        if value > best[1] + 0.1 * (1.0 - best[1]):
            best = (formula, value)
    return FoundShape(
        term.source.depends_on, term.source.sort, best[0], best[1], x.tolist(), y.tolist()
    )


def _struck(strike: Strike, q: FloatArray) -> FoundShape:
    x, y = outline(strike, q)
    formula = f"{float(q[0]):.3g} from {strike.begin:.4g} to {strike.end:.4g} s"
    if strike.recording is not None:
        formula += " of one recording"
    return FoundShape("time", strike.sort, formula, 1.0, x.tolist(), y.tolist())


def _formulas(name: str, x: FloatArray, y: FloatArray, turning: bool) -> list[tuple[str, float]]:
    found = []
    if turning:
        for order in range(1, 5):
            basis = np.column_stack([np.ones_like(x), np.cos(order * x), np.sin(order * x)])
            fitted, coefficients = _fitted(basis, y)
            size = float(np.hypot(coefficients[1], coefficients[2]))
            turn = float(np.arctan2(-coefficients[2], coefficients[1]))
            found.append((f"{size:.3g} cos({order} {name} + {turn:.3g})", _r2(y, fitted)))
        found.append(_bump(name, x, y))
        return found
    if x[0] < 0.0 < x[-1]:
        fitted, (level, slope) = _fitted(np.column_stack([np.ones_like(x), np.abs(x)]), y)
        found.append((f"{level:+.3g} {slope:+.3g} |{name}|", _r2(y, fitted)))
    for power in (1, 2, 3):
        basis = np.column_stack([x**k for k in range(power + 1)])
        fitted, coefficients = _fitted(basis, y)
        terms = [f"{c:+.3g} {name}^{k}" for k, c in enumerate(coefficients.tolist())]
        found.append((" ".join(terms), _r2(y, fitted)))
    return found


def _bump(name: str, x: FloatArray, y: FloatArray) -> tuple[str, float]:
    """A local spot on the turn."""
    best = ("", 0.0)
    for centre in np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False):
        away = np.abs(np.angle(np.exp(1j * (x - centre))))
        for width in (0.15, 0.25, 0.4, 0.6, 0.9):
            basis = np.column_stack([np.ones_like(x), np.exp(-0.5 * (away / width) ** 2)])
            fitted, coefficients = _fitted(basis, y)
            value = _r2(y, fitted)
            if value > best[1]:
                text = (
                    f"{coefficients[1]:.3g} exp(-((({name} - {centre:.3g}) mod turn)/{width})^2/2)"
                )
                best = (text, value)
    return best


def _fitted(basis: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    coefficients = np.asarray(np.linalg.lstsq(basis, y, rcond=None)[0], dtype=np.float64)
    return basis @ coefficients, coefficients


def _r2(y: FloatArray, fitted: FloatArray) -> float:
    spread = float(np.sum((y - y.mean()) ** 2))
    return 1.0 - float(np.sum((y - fitted) ** 2)) / spread if spread > 0 else 0.0
