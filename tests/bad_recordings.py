"""Simulated recordings and the ways to spoil them; run as a script it measures the screening.

`python tests/bad_recordings.py 24 7` prints how often 24 spoilt recordings of each kind are
named, and how many clean ones raise a false alarm; 7 picks the seeds.
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drill_env import Rig
from drill_env.identification.screening import findings
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import (
    SIGNAL_KINDS,
    Recording,
    Signal,
    encoder_step,
    signal_samples,
)
from drill_env.sensors import Encoder, read_encoder

RANDOM = ("quasi-random", "steps", "chirp")
VARIED = tuple(kind for kind in SIGNAL_KINDS if kind != "constant")
TURN = 2.0 * np.pi
NAMES = ("km", "Ju", "Tsu", "bu", "Jl", "ktheta", "Tsl", "T1", "T2", "beta1", "beta2", "bl")


def any_rig(rng, spread=0.3):
    paper = Rig.paper()
    return paper.replace(
        **{n: getattr(paper, n) * rng.uniform(1 - spread, 1 + spread) for n in NAMES}
    )


def any_signal(rng, kind, rate, seconds):
    options = {}
    if kind == "constant":
        options = {"offset": rng.uniform(1, 5) * rng.choice([1, 1, -1])}
    elif kind in ("quasi-random", "steps"):
        options = {"seed": int(rng.integers(10**6))}
    elif kind == "harmonic":
        options = {"frequency": rng.uniform(0.05, 0.5)}
    if kind in ("harmonic", "chirp") and rng.random() < 0.5:
        options |= {"offset": 0.0, "amplitude": rng.uniform(2, 5)}
    return Signal(kind, seconds=seconds, rate=rate, **options)


def simulated(seed, kind=None, rate=None, seconds=None, counts=8192, rig=None):
    """Channels of a run of some rig from rest or in motion, and the rig."""
    rng = np.random.default_rng(seed)
    rig = rig or any_rig(rng)
    rate = rate or float(rng.choice([50, 100, 200, 500, 1000]))
    seconds = seconds or float(rng.uniform(20, 50))
    t, u = signal_samples(any_signal(rng, kind or str(rng.choice(SIGNAL_KINDS)), rate, seconds))
    initial = None
    if rng.random() < 0.5:
        omega = rng.uniform(-6, 6)
        initial = np.array([rng.uniform(-2, 2), omega + rng.normal(), omega + rng.normal(), 0.0])
    run = simulate(
        rig, sampled_voltage(t, u), float(t[-1]), t_eval=t, initial=initial, rtol=1e-9, atol=1e-11
    )
    zeros = rng.uniform(0, TURN, 2) * (rng.random() < 0.3)
    device = Encoder(counts_per_rev=counts, rate_hz=rate)
    theta_u = read_encoder(run.theta_u + zeros[0], device)
    theta_l = read_encoder(run.theta_l + zeros[1], device)
    return {"t": t, "u": u, "theta_u": theta_u, "theta_l": theta_l}, rig


def recording_of(c):
    steps = {name: encoder_step(c[name]) for name in ("theta_u", "theta_l") if name in c}
    return Recording(**c, quanta={name: step for name, step in steps.items() if step})


def scaled(**factors):
    return lambda c, rig, rng: c | {name: c[name] * factor for name, factor in factors.items()}


def exchanged(one, two):
    return lambda c, rig, rng: c | {one: c[two], two: c[one]}


def rows(c, kept):
    """Those rows, with times as if none were missing."""
    return {name: values[kept] for name, values in c.items()} | {
        "t": np.arange(len(kept)) * (c["t"][1] - c["t"][0])
    }


def backwards(c, rig, rng):
    return {name: values[::-1].copy() for name, values in c.items()} | {"t": c["t"]}


def shifted(c, rig, rng):
    lag = int(rng.uniform(0.15, 1.0) / (c["t"][1] - c["t"][0]))
    n = len(c["t"]) - lag
    late = {"u": c["u"][:n], "theta_u": c["theta_u"][lag:], "theta_l": c["theta_l"][lag:]}
    early = {"u": c["u"][lag:], "theta_u": c["theta_u"][:n], "theta_l": c["theta_l"][:n]}
    return {"t": c["t"][:n]} | (late if rng.random() < 0.5 else early)


def dropped(c, rig, rng):
    return rows(c, np.flatnonzero(rng.random(len(c["t"])) > 0.01))


def doubled(c, rig, rng):
    n = len(c["t"])
    return rows(c, np.sort(np.append(np.arange(n), np.flatnonzero(rng.random(n) < 0.01))))


def block_lost(c, rig, rng):
    n = len(c["t"])
    start = int(n * rng.uniform(0.3, 0.6))
    return rows(c, np.append(np.arange(start), np.arange(start + n // 5, n)))


def glued(c, rig, rng):
    half = np.arange(len(c["t"]) // 2)
    return rows(c, np.append(half, half))


def stepped(name):
    def spoil(c, rig, rng):
        jump = rng.uniform(0.3, 1.0) * rng.choice([-1, 1])
        return c | {name: c[name] + jump * (c["t"] > c["t"][-1] * rng.uniform(0.2, 0.8))}

    return spoil


def dead(*names):
    def spoil(c, rig, rng):
        half = len(c["t"]) // 2
        return c | {
            n: np.append(c[n][:half], np.full(len(c["t"]) - half, c[n][half])) for n in names
        }

    return spoil


def velocity(c, name):
    from scipy.ndimage import gaussian_filter1d

    step = c["t"][1] - c["t"][0]
    return gaussian_filter1d(np.gradient(c[name], step), max(1.0, 0.02 / step))


def velocities(c, rig, rng):
    return c | {name: velocity(c, name) for name in ("theta_u", "theta_l")}


def current(c, rig, rng):
    """What a shunt shows where nine tenths of the damping are back-emf."""
    return c | {"u": c["u"] - 0.9 * rig.bu / rig.km * velocity(c, "theta_u")}


def of_another_run(c, rig, rng):
    return c | {"u": np.roll(c["u"], len(c["u"]) // 2)}


@dataclass(frozen=True)
class Bad:
    """A way to spoil a recording, and the finding that names it."""

    spoil: Callable
    code: str
    says: str = ""
    kinds: tuple[str, ...] = SIGNAL_KINDS


BOTH = ("theta_u", "theta_l")
COUNT = 8192 / TURN
PHYSICAL: dict[str, Bad] = {
    "sign of u": Bad(scaled(u=-1), "sign", "sign of u is"),
    "sign of theta_u": Bad(scaled(theta_u=-1), "sign", "sign of theta_u is"),
    "sign of theta_l": Bad(scaled(theta_l=-1), "sign", "sign of theta_l is"),
    "sign of both angles": Bad(scaled(theta_u=-1, theta_l=-1), "sign", "or those of both angles"),
    "swapped encoders": Bad(exchanged(*BOTH), "swapped_encoders"),
    "swapped u, theta_u": Bad(
        exchanged("u", "theta_u"), "swapped_columns", "--map u=theta_u", VARIED
    ),
    "swapped u, theta_l": Bad(
        exchanged("u", "theta_l"), "swapped_columns", "--map u=theta_l", VARIED
    ),
    "same column twice": Bad(lambda c, rig, rng: c | {"theta_l": c["theta_u"]}, "same_column"),
    "degrees, both": Bad(scaled(theta_u=360 / TURN, theta_l=360 / TURN), "unit", "degrees"),
    "degrees, theta_u": Bad(scaled(theta_u=360 / TURN), "encoder_units", "theta_u:deg"),
    "degrees, theta_l": Bad(scaled(theta_l=360 / TURN), "encoder_units", "theta_l:deg"),
    "counts, both": Bad(scaled(theta_u=COUNT, theta_l=COUNT), "unit", "counts"),
    "counts, theta_u": Bad(scaled(theta_u=COUNT), "encoder_units", "counts"),
    "counts, theta_l": Bad(scaled(theta_l=COUNT), "encoder_units", "counts"),
    "turns, both": Bad(scaled(theta_u=1 / TURN, theta_l=1 / TURN), "unit", "turns"),
    "turns, theta_l": Bad(scaled(theta_l=1 / TURN), "encoder_units", "theta_l:turn"),
    "counts x 4, both": Bad(scaled(theta_u=4, theta_l=4), "unit", "four-fold"),
    "counts x 4, theta_u": Bad(scaled(theta_u=4), "encoder_units", "theta_u seems"),
    "counts x 4, theta_l": Bad(scaled(theta_l=4), "encoder_units", "theta_l seems"),
    "millivolts": Bad(scaled(u=1e3), "unit", "mV"),
    "current for voltage": Bad(current, "current", "", VARIED),
    "clock in min": Bad(scaled(t=1 / 60), "clock"),
    "clock in ms, stated as s": Bad(scaled(t=1e3), "clock"),
    "clock x 4": Bad(scaled(t=4), "clock"),
    "time backwards": Bad(backwards, "reversed_time"),
    "voltage shifted 0.15-1 s": Bad(shifted, "shifted_voltage", "", RANDOM),
    "voltage of another run": Bad(of_another_run, "unrelated", "", RANDOM),
    "rows dropped, renumbered": Bad(dropped, "dropped_rows"),
    "rows doubled, renumbered": Bad(doubled, "duplicated_rows"),
    "a fifth lost, renumbered": Bad(block_lost, "glued"),
    "two glued, renumbered": Bad(glued, "glued"),
    "offset jump, theta_u": Bad(stepped("theta_u"), "jump", "theta_u jumps"),
    "offset jump, theta_l": Bad(stepped("theta_l"), "jump", "theta_l jumps"),
    "dead from the middle, theta_u": Bad(dead("theta_u"), "dead_encoder", "theta_u stays"),
    "dead from the middle, theta_l": Bad(dead("theta_l"), "dead_encoder", "theta_l stays"),
    "dead from the middle, both": Bad(dead(*BOTH), "dead_encoder"),
    "velocities for angles": Bad(velocities, "velocity", "", VARIED),
}


def noisy(seed):
    """A clean recording of a harder kind: coarse, noisy or jittering encoders."""
    rng = np.random.default_rng([7, seed])
    c, _ = simulated(seed, counts=int(rng.choice([1000, 2500, 8192, 0])))
    for name in BOTH:
        c[name] = c[name] + rng.normal(0, rng.choice([0.0, 5e-4, 2e-3]), len(c["t"]))
    kept = np.flatnonzero(rng.random(len(c["t"])) > rng.choice([0.0, 0.02]))
    return {name: values[kept] for name, values in c.items()}


def closed_loop(seed, rate=100.0, seconds=20.0):
    """A clean recording under a speed controller that sees the upper encoder and the string."""
    rng = np.random.default_rng([8, seed])
    rig, device = any_rig(rng), Encoder(rate_hz=rate)
    stiff, soft, target = rng.uniform(0.5, 4), rng.uniform(0, 0.5), rng.uniform(1, 6)
    state, modes, rows = np.zeros(4), None, []
    seen = np.zeros(2)
    for number in range(int(rate * seconds)):
        now = read_encoder(np.array([state[0] + state[3], state[3]]), device)
        speed = (now[0] - seen[0]) * rate
        seen = now
        u = float(np.clip(stiff * (target - speed) + soft * (now[0] - now[1]), -5, 5))
        rows.append((number / rate, u, *now))
        run = simulate(rig, u, 1 / rate, rate=rate, initial=state, modes=modes)
        state, modes = run.final_state, run.final_modes
    t, u, theta_u, theta_l = np.array(rows).T
    return {"t": t, "u": u, "theta_u": theta_u, "theta_l": theta_l}


def disc_alone(seed):
    """A clean stage-1 recording."""
    rng = np.random.default_rng([9, seed])
    rig = any_rig(rng)
    disc = Rig.one_inertia(km=rig.km, Ju=rig.Ju, Tsu=rig.Tsu, bu=rig.bu, dTsu=rig.dTsu, dbu=rig.dbu)
    c, _ = simulated(60_000 + seed, SIGNAL_KINDS[seed % 7], rig=disc)
    return {name: c[name] for name in ("t", "u", "theta_u")}


def clean_sets(number):
    """Names and channels of clean recordings of every sort."""
    plain = simulated(90_000 + number, SIGNAL_KINDS[number % 7])[0]
    yield "both encoders", plain
    yield "upper encoder only", {k: plain[k] for k in ("t", "u", "theta_u")}
    yield "upper disc alone", disc_alone(number)
    yield "lower encoder only", {k: plain[k] for k in ("t", "u", "theta_l")}
    yield "noisy, coarse or with gaps", noisy(80_000 + number)
    if number % 5 == 0:
        yield "closed loop", closed_loop(number)


def main(trials, series):
    first = 100_000 * series
    warnings.simplefilter("ignore")
    tried: Counter[str] = Counter()
    for number in range(5 * trials):
        for what, c in clean_sets(first + number):
            tried[what] += 1
            for note in findings(recording_of(c), alone="upper disc" in what):
                print(f"false alarm, {what}, number {number}: {note}")
    print("clean recordings:", dict(tried), flush=True)
    for name, bad in PHYSICAL.items():
        codes = []
        named = 0
        for trial in range(trials):
            rng = np.random.default_rng([3, series, trial])
            c, rig = simulated(first + 70_000 + trial, bad.kinds[trial % len(bad.kinds)])
            notes = findings(recording_of(bad.spoil(c, rig, rng)))
            codes += [note.code for note in notes] or ["nothing"]
            named += any(note.code == bad.code and bad.says in str(note) for note in notes)
        others = sorted(set(codes) - {bad.code})
        print(
            f"| {name} | `{bad.code}` | {named} | {trials - codes.count('nothing')} |",
            ", ".join(f"{code} {codes.count(code)}" for code in others),
            flush=True,
        )


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
