"""The detective on rigs that are no drill-string: servo pendulum, coupled drives, flexible link.

python benchmarks/other_rigs.py [--only NAME]... [--json out.json]

The plant below shares no code with the package: small fixed steps, friction that holds until it is
overcome. Each case leaves one thing out of the model that it gives to the diagnosis, or nothing;
two recordings are fitted, a third one judges.
"""

from __future__ import annotations

import json
import math
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numba
import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.parameters import Rig
from drill_env.recordings import Recording

COUNT = 2.0 * math.pi / 4096
SPEED_NOISE = 0.02
GAUGE_NOISE, GAUGE_DIGIT = 1e-3, 1e-4
STEPS = 100
WHOLE = ("consistent", "parameters")


@dataclass(frozen=True)
class Plant:
    """A motor and, behind a coupling, a load; SI units. Without a load, an axis with a weight."""

    km: float = 0.05
    Ju: float = 2e-3
    Tu: float = 0.01
    bu: float = 0.012
    Jl: float = 4e-3
    k: float = 1.5
    Tl: float = 4e-3
    bl: float = 4e-3
    damping: float = 0.0
    gap: float = 0.0
    hardening: float = 0.0
    drag: float = 0.0
    weight: float = 0.0
    noise: float = 8e-4

    def rig(self) -> Rig:
        """What a lab would write down of it."""
        if self.Jl == 0.0:
            return Rig.one_inertia(km=self.km, Ju=self.Ju, Tsu=self.Tu, bu=self.bu)
        return Rig.paper().replace(
            km=self.km, Ju=self.Ju, Tsu=self.Tu, dTsu=0.0, bu=self.bu, dbu=0.0, Jl=self.Jl,
            ktheta=self.k, Tsl=self.Tl, T1=0.0, T2=0.0, bl=self.bl, friction="coulomb",
        )  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A plant, what its model lacks and the number that measures it, and how it is recorded."""

    plant: Plant
    effect: str = ""
    truth: dict[str, float] = field(default_factory=dict)
    volts: float = 8.0
    rate: float = 250.0
    seconds: float = 30.0
    measured: str = "angles"


DRIVES = Plant()
LINK = Plant(km=0.4, Ju=6e-3, Tu=0.02, bu=0.08, Jl=8e-3, k=3.0, Tl=1e-4, bl=5e-4, noise=4e-3)
PENDULUM = Plant(km=0.3, Ju=0.02, Tu=0.03, bu=0.03, Jl=0.0, k=0.0, weight=0.6, noise=4e-3)

CASES = {
    "pendulum that swings": Case(
        PENDULUM, "upper_unbalance", {"torque": 0.6}, volts=1.6, rate=200.0
    ),
    "pendulum that turns over": Case(
        PENDULUM, "upper_unbalance", {"torque": 0.6}, volts=4.0, rate=200.0
    ),
    "pendulum on a quiet motor": Case(
        Plant(**{**PENDULUM.__dict__, "noise": 1e-6}), "upper_unbalance", {"torque": 0.6},
        volts=4.0, rate=200.0,
    ),
    "coupled drives": Case(DRIVES),
    "coupled drives, damped belt": Case(
        Plant(damping=4e-3), "string_damping", {"damping": 4e-3}
    ),
    "coupled drives, play": Case(Plant(gap=0.01), "string_play", {"gap": 0.01}),
    "coupled drives, drag": Case(Plant(drag=3e-5), "quadratic_drag", {"coefficient": 3e-5}),
    "coupled drives, drag, by torque": Case(
        Plant(drag=3e-5), "quadratic_drag", {"coefficient": 3e-5}, measured="torque"
    ),
    "coupled drives, drag, by speeds": Case(
        Plant(drag=3e-5), "quadratic_drag", {"coefficient": 3e-5}, measured="speeds"
    ),
    "flexible link, damped": Case(
        Plant(**{**LINK.__dict__, "damping": 6e-3}), "string_damping", {"damping": 6e-3}, volts=5.0
    ),
    "flexible link, stiffening": Case(
        Plant(**{**LINK.__dict__, "hardening": 4.0}), "string_hardening", {"coefficient": 4.0},
        volts=5.0,
    ),
    "flexible link, strain gauge": Case(LINK, volts=5.0, measured="gauge"),
    "flexible link, strain gauge, stiffening": Case(
        Plant(**{**LINK.__dict__, "hardening": 4.0}), "string_hardening", {"coefficient": 4.0},
        volts=5.0, measured="gauge",
    ),
}  # fmt: skip


@numba.njit(cache=True)
def _pushed(speed, torque, friction, inertia, step):
    if speed == 0.0:
        if abs(torque) <= friction:
            return 0.0
        return step * (torque - np.sign(torque) * friction) / inertia
    after = speed + step * (torque - np.sign(speed) * friction) / inertia
    return 0.0 if after * speed < 0.0 else after


@numba.njit(cache=True)
def _run(u, push, dt, p):
    km, ju, tu, bu, jl, k, tl, bl, damping, gap, hardening, drag, weight = p
    out = np.zeros((len(u), 4))
    twist = wu = wl = theta = 0.0
    step = dt / STEPS
    for i in range(len(u)):
        out[i] = theta + twist, theta, wu, wl
        for _ in range(STEPS):
            free = np.sign(twist) * max(abs(twist) - 0.5 * gap, 0.0)
            string = k * free + hardening * free**3 + damping * (wu - wl)
            drive = km * u[i] + push[i] - bu * wu - string - weight * np.sin(theta + twist)
            load = string - bl * wl - drag * abs(wl) * wl
            wu = _pushed(wu, drive, tu, ju, step)
            if jl > 0.0:
                wl = _pushed(wl, load, tl, jl, step)
            twist += step * (wu - wl)
            theta += step * wl
    return out


def recorded(case: Case, seed: int) -> Recording:
    """One recording: levels of voltage at random, a coloured torque on the motor, counts."""
    rng = np.random.default_rng(seed)
    plant, n = case.plant, int(case.seconds * case.rate)
    t = np.arange(n) / case.rate
    edges = np.cumsum(rng.uniform(0.2, 1.2, n))
    u = case.volts * rng.uniform(-1.0, 1.0, n)[np.searchsorted(edges, t)]
    keep = math.exp(-1.0 / (0.1 * case.rate))
    push = np.zeros(n)
    for i in range(1, n):
        push[i] = keep * push[i - 1] + plant.noise * math.sqrt(1.0 - keep**2) * rng.normal()
    numbers = tuple(float(v) for name, v in plant.__dict__.items() if name != "noise")
    theta_u, theta_l, omega_u, omega_l = _run(u, push, 1.0 / case.rate, numbers).T
    given: dict[str, Any] = {"source": f"{seed}"}
    if case.measured == "speeds":
        given |= {"omega_u": omega_u + SPEED_NOISE * rng.normal(size=n)}
        given |= {"omega_l": omega_l + SPEED_NOISE * rng.normal(size=n)}
    else:
        both = {"theta_u": theta_u, "theta_l": theta_l}
        read = {name: COUNT * np.round(angle / COUNT) for name, angle in both.items()}
        if plant.Jl == 0.0:
            del read["theta_l"]
        steps = dict.fromkeys(read, COUNT)
        if case.measured == "gauge":
            # Written as labs do: the hub's angle less the twist, with the noise of both.
            twist = theta_u - theta_l + GAUGE_NOISE * rng.normal(size=n)
            lower = read["theta_u"] - twist
            read["theta_l"] = GAUGE_DIGIT * np.round(lower / GAUGE_DIGIT)
            steps["theta_l"] = GAUGE_DIGIT
        given |= {**read, "quanta": steps}
    if case.measured == "torque":
        return Recording(t, plant.km * u, **given, drive="torque")
    return Recording(t, u, **given)


def row_of(name: str) -> dict[str, Any]:
    """What the diagnosis says of one case, and whether it is right."""
    case, began = CASES[name], time.process_time()
    *fit, held = (recorded(case, seed) for seed in (1, 2, 3))
    rig = case.plant.rig()
    if case.measured == "torque":
        rig = rig.replace(km=1.0)
    found = diagnose(fit, rig, [held], options=DiagnosisOptions(given_rig=True, doubt=0.1)).result
    said = {e.id: e for e in found.effects}
    numbers = {
        number: {"true": true, "found": vars_of(said[case.effect].parameters[number])}
        for number, true in case.truth.items()
        if case.effect in said
    }
    return {
        "case": name,
        "missing": case.effect,
        "verdict": found.verdict,
        "said": {e.id: e.probability for e in found.effects},
        "right": list(said) == [case.effect] if case.effect else found.verdict in WHOLE,
        "numbers": numbers,
        "errors": _errors(found.fit),
        "cpu_s": time.process_time() - began,
    }


def _errors(fit: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Errors of the longest prediction of the held-out recording, before and after."""
    if "prediction" in fit:
        told = {k: v for k, v in fit["prediction"].items() if k != "leads_s"}
        return {
            name: {"before": rms["before_rms"][-1], "after": rms["after_rms"][-1]}
            for name, rms in told.items()
        }
    return {
        name: {"before": rms["before_rms"], "after": rms["after_rms"]}
        for name, rms in fit["five_second_prediction"].items()
    }


def vars_of(number: Any) -> list[float]:
    """Value and interval of a number."""
    return [number.value, number.low, number.high]


def main(
    only: Annotated[list[str] | None, typer.Option(help="Cases; all by default.")] = None,
    json_out: Annotated[Path | None, typer.Option("--json", help="Where rows go.")] = None,
) -> None:
    """Diagnose every case and print one line of each."""
    console, rows = Console(), []
    unknown = sorted(set(only or ()) - set(CASES))
    if unknown:
        raise typer.BadParameter(f"no case {unknown[0]!r}; take one of {', '.join(CASES)}")
    table = Table(
        "case",
        "missing",
        "said",
        "true",
        "found",
        "error of the prediction, before to after",
        "CPU s",
    )
    for name in only or CASES:
        console.print(f"{name} ...")
        row = row_of(name)
        rows.append(row)
        table.add_row(*_cells(row))
        if json_out is not None:
            json_out.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    console.print(table)


def _cells(row: dict[str, Any]) -> list[str]:
    numbers = list(row["numbers"].values())
    true = f"{numbers[0]['true']:.3g}" if numbers else ""
    found = "{:.4g} ({:.4g} to {:.4g})".format(*numbers[0]["found"]) if numbers else ""
    errors = list(row["errors"].values())
    fell = f"{errors[-1]['before']:.3g} to {errors[-1]['after']:.3g}" if errors else ""
    said = ", ".join(f"{k} {v:.2f}" for k, v in row["said"].items()) or row["verdict"]
    return [
        row["case"],
        row["missing"] or "nothing",
        said,
        true,
        found,
        fell,
        f"{row['cpu_s']:.0f}",
    ]


if __name__ == "__main__":
    typer.run(main)
