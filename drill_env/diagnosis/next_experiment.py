"""The one recording that best separates what is still confused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.diagnosis.declare import extended_rig
from drill_env.diagnosis.extended import evaluate, motion_of
from drill_env.diagnosis.fit import Fit, Setting, prior
from drill_env.diagnosis.probability import CONFUSED, probability_in
from drill_env.diagnosis.result import NextExperiment
from drill_env.diagnosis.rounds import Attempt, Found
from drill_env.identification.coordinates import solved
from drill_env.identification.prediction_error import path_of
from drill_env.identification.samples import prepare
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording
from drill_env.recordings.signals import Signal, signal_samples

_SECONDS, _RATE = 60.0, 200.0
# A signal may take the rig this much further than the recordings did: a menu's sine may lie on the
# torsional resonance, and a string that is wound up breaks.
_FURTHER = 1.3


def _menu() -> tuple[Signal, ...]:
    plain = Signal("quasi-random", seconds=_SECONDS, rate=_RATE, limit=5.0)
    sine, steps = replace(plain, kind="harmonic"), replace(plain, kind="steps")
    chirp = replace(plain, kind="chirp")
    return (
        plain,
        replace(plain, dwell=4.0, seed=1),
        replace(sine, offset=0.0, amplitude=4.0, frequency=0.25),
        replace(sine, offset=1.5, amplitude=1.5, frequency=0.25),
        replace(sine, offset=2.5, amplitude=2.0, frequency=0.05),
        replace(sine, offset=2.5, amplitude=2.5, frequency=1.0),
        replace(sine, offset=0.0, amplitude=5.0, frequency=1.0),
        replace(steps, dwell=1.0, seed=2),
        replace(steps, dwell=4.0, seed=3),
        replace(steps, dwell=12.0, seed=4),
        replace(plain, kind="ramp", offset=-5.0, amplitude=10.0),
        replace(plain, kind="constant", offset=4.5),
        replace(chirp, offset=1.5, amplitude=3.0, frequency_end=2.0),
        replace(chirp, offset=0.0, amplitude=5.0, frequency_end=2.0),
    )


def next_experiment(found: Found) -> NextExperiment | None:
    """The signal that best tells what was found from its best rival, if they are still confused.

    Args:
        found: the search.
    """
    pair = _confused(found)
    if pair is None:
        return None
    best: tuple[float, Signal] | None = None
    for signal in _menu():
        odds = _expected(found, *pair, signal)
        if odds is not None and (best is None or odds > best[0]):
            best = (odds, signal)
    if best is None:
        return None
    odds, signal = best
    return NextExperiment(
        _words(signal), _command(signal), [attempt.term.id for attempt in pair], odds
    )


def _confused(found: Found) -> tuple[Attempt, Attempt] | None:
    """What was found first and its best rival that was neither found too nor given up."""
    first, present = found.rounds[0], {term.id for term in found.final.terms}
    ranked = sorted((*first.named, *first.shapes), key=lambda a: -a.criterion)
    left = [a for a in ranked if a.term.id not in found.rejected]
    leading = [a for a in left if a.term.id in present][:1] or left[:1]
    rivals = [a for a in left if a.term.id not in present and a not in leading]
    rivals.sort(key=lambda a: -probability_in(first, a.term.id))
    if not rivals or probability_in(first, rivals[0].term.id) < CONFUSED:
        return None
    return leading[0], rivals[0]


def _expected(found: Found, true: Attempt, other: Attempt, signal: Signal) -> float | None:
    """Expected log odds for the first candidate, the second one free to bend."""
    t, u = signal_samples(signal)
    rig = extended_rig(true.fit.rig, true.fit.terms)
    try:
        run = simulate(
            rig,
            sampled_voltage(t, u),
            float(t[-1] - t[0]),
            t_eval=t,
            method="dopri5",
            rtol=1e-9,
            atol=1e-11,
        )
        states, angles = run.state, run.readings
        if not _bearable(true.fit, states):
            return None
        recording = Recording(t, u, angles[:, 0], angles[:, 1], source="proposed")
        samples = prepare(recording, true.fit.rig)
        values = []
        for attempt in (true, other):
            setting = replace(found.setting, samples=(samples,))
            fit = attempt.fit
            path = path_of(samples, fit.rig, fit.noise, samples.starts, setting.robust)
            motion = motion_of(samples, fit.noise, path)
            there = evaluate(
                setting, fit.vector, fit.terms, true.fit.noise, [samples.starts], [motion]
            )
            values.append(_least(setting, fit, there))
    except (InputError, RuntimeError, np.linalg.LinAlgError):
        return None
    odds = 0.5 * (values[1] - values[0])
    return float(odds) if math.isfinite(odds) else None


def _bearable(fit: Fit, states: FloatArray) -> bool:
    """Whether twist and speeds stay near what the recordings have shown."""
    reached = np.max([np.abs(m.states[:, :3]).max(axis=0) for m in fit.motions], axis=0)
    return bool(np.all(np.abs(states[:, :3]).max(axis=0) <= _FURTHER * reached))


def _least(setting: Setting, fit: Fit, there: Fit) -> float:
    """Least value on a new recording that the candidate reaches within what is known by now.

    What was believed before any recording is in the fit already, so it is taken out of `there`.
    """
    weight, miss = prior(setting, fit.vector, fit.terms)
    value = there.value - float(weight @ miss**2)
    slope = there.gradient - weight * miss
    both = fit.information + there.information - np.diag(weight) + 1e-9 * np.eye(len(slope))
    return value - float(slope @ solved(both, slope))


def _words(signal: Signal) -> str:
    offset, amplitude = signal.levels
    held = f" held for {signal.dwell:g} s" if signal.dwell else ""
    extra = {
        "quasi-random": held,
        "steps": held,
        "harmonic": f" of {signal.frequency} Hz and {amplitude:g} V around {offset:g} V",
        "chirp": f" up to {signal.frequency_end:g} Hz around {offset:g} V",
        "constant": f" of {offset:g} V",
    }.get(signal.kind, "")
    return f"a {signal.kind} voltage{extra} for {signal.seconds:g} s"


def _command(signal: Signal) -> str:
    return f"drill-env signal {signal.text} --out play.csv"
