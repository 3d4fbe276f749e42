"""What the true structure leaves of the held-out error when it is refitted on the same recordings.

`python -m benchmarks.concealed.oracle --cases DIR --answers DIR --out DIR` takes the single and
pair cases whose effects are in the tool's library. The tool's own fit of the rig with the true
effects starts at the truth, where its numbers are known in the tool's terms, and again at the
tool's fit of the rig alone; the better one is the oracle. A file a case, none for cases without
one; cases that are done are not done again.
"""

from __future__ import annotations

import functools
import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from benchmarks.concealed.seal import open_answers
from benchmarks.concealed.terms import in_tool_terms
from drill_env._engine import run
from drill_env._errors import InputError
from drill_env._files import make_folder, write_text
from drill_env.cli._engine_options import (
    AddressOption,
    EngineKind,
    EngineOption,
    JobsOption,
    counted,
    engine_of,
)
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.extended import evaluate, motion_of
from drill_env.diagnosis.first_look import first_look
from drill_env.diagnosis.fit import Fit, Setting, strain
from drill_env.diagnosis.fit_changes import added
from drill_env.diagnosis.held_out import judge, judged_channels, rms
from drill_env.diagnosis.in_filter import within_filter
from drill_env.diagnosis.joint import descend_jointly, polished
from drill_env.diagnosis.linearised import linearised_at
from drill_env.diagnosis.offered import free_parameters
from drill_env.diagnosis.scan import score_effects
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import path_of
from drill_env.identification.samples import Samples, prepare
from drill_env.parameters import Rig
from drill_env.recordings import read_recording

# What the angles do not tell moves all of these together.
_TORQUES = ("km", "Ju", "Tsu", "dTsu", "bu", "dbu", "Jl", "ktheta", "Tsl", "T1", "T2", "bl")
# Told by the tool as losses at single moments: neither its library's formula nor a truth to start.
_AT_MOMENTS = frozenset({"missed_counts_upper", "missed_counts_lower"})
_ROUNDS = 12


def has_oracle(answer: Mapping[str, Any]) -> bool:
    """Whether the tool has the true structure, and recordings can show it."""
    return answer["kind"] in ("single", "pair") and all(
        e["identifiable"] and e["id"] in LIBRARY and e["id"] not in _AT_MOMENTS
        for e in answer["effects"]
    )


def true_rig(rig: Mapping[str, float], start: Rig) -> tuple[Rig, float]:
    """The true rig at the scale of torque that the tool holds, and that scale over the true one."""
    scale = start.Ju / rig["Ju"]
    values = {n: v * scale if n in _TORQUES else v for n, v in rig.items()}
    return start.replace(**values), scale


def true_term(effect: Mapping[str, Any], rig: Mapping[str, float], scale: float) -> Term | None:
    """An effect at its true numbers, those without a truth in the middle; None without any."""
    numbers = in_tool_terms(effect["id"], effect["parameters"], rig)
    if not numbers:
        return None
    source = Named(LIBRARY[effect["id"]])
    q = [
        numbers.get(p.name, p.grid[len(p.grid) // 2]) * (scale if "Nm" in p.unit else 1.0)
        for p in source.effect.parameters
    ]
    return Term(source, source.bounded(np.array(q)))


def from_truth(setting: Setting, rig: Rig, terms: Sequence[Term]) -> Fit:
    """The fit that begins at the true rig with the true effects, and so with little noise."""
    noise = NoiseModel()
    for name, key in (("encoder_u", "theta_u"), ("encoder_l", "theta_l")):
        step = max(s.recording.quanta[key] for s in setting.samples)
        noise = replace(noise, **{name: step / math.sqrt(12.0)})
    starts = [s.starts for s in setting.samples]
    motions = [motion_of(s, noise, path_of(s, rig, noise, s.starts)) for s in setting.samples]
    plain = replace(setting, robust=math.inf)
    here = evaluate(plain, setting.coordinates.vector(rig), (), noise, starts, motions)
    for term in terms:
        here = added(plain, here, term)
    here = descend_jointly(plain, here, limit=_ROUNDS, enough=2.0, only=None)
    return within_filter(setting, polished(setting, here), _told_to_nobody)


def from_base(setting: Setting, base: Fit, effects: Sequence[str]) -> Fit | None:
    """The fit that begins at the tool's rig and adds the true effects as its search does."""
    here = base
    for name in effects:
        scored = score_effects(linearised_at(setting, here), [LIBRARY[name]], 1)
        if not scored:
            return None
        here = first_look(setting, here, scored[0]).start(setting, here)
        here = descend_jointly(setting, here, limit=_ROUNDS, enough=2.0)
    return within_filter(setting, polished(setting, here), _told_to_nobody)


def _told_to_nobody(text: str) -> None:
    """The steps of one fit among hundreds are no news."""


@dataclass(frozen=True, eq=False)
class Data:
    """Recordings of a case as the tool prepares them, and its fit of the rig alone."""

    setting: Setting
    base: Fit
    held: Sequence[Samples]

    def errors(self, fit: Fit) -> dict[str, float]:
        """Rms error of the held-out 5 s predictions, rad, by channel."""
        judged = [judge(s, self.setting, fit) for s in self.held]
        return {
            name: rms(judged, "short", disc)
            for disc, name in enumerate(judged_channels(self.held[0]))
        }


def data_of(case: Path, start: Rig) -> Data:
    """Read a case and fit the rig alone.

    Raises:
        InputError: a recording is missing or not readable.
    """
    fitted, held = (
        [prepare(read_recording(p), start) for p in sorted(case.glob(f"{stem}-*.csv"))]
        for stem in ("fit", "holdout")
    )
    if not fitted or not held:
        raise InputError(f"{case} has no fit-*.csv or no holdout-*.csv: give the folder of `make`")
    setting, base = base_fit(fitted, start, free_parameters(start))
    release = setting.samples[0].release
    return Data(setting, base, [replace(s, release=release) for s in held])


def refit(answer: Mapping[str, Any], case: Path) -> dict[str, Any]:
    """The oracle of one case."""
    began, start = time.process_time(), Rig.paper()
    data = data_of(case, start)
    rig, scale = true_rig(answer["rig"], start)
    terms = [true_term(e, answer["rig"], scale) for e in answer["effects"]]
    ways = {"tool": from_base(data.setting, data.base, [e["id"] for e in answer["effects"]])}
    known = [t for t in terms if t is not None]
    if len(known) == len(terms):
        ways["truth"] = from_truth(data.setting, rig, known)
    fits = {name: fit for name, fit in ways.items() if fit is not None}
    if not fits:
        raise InputError(
            f"{case}: the tool finds nothing along the true effects and none starts it"
        )
    begun = min(fits, key=lambda name: fits[name].value)
    fit = fits[begun]
    return {
        "schema": 1, "case": answer["case"], "effects": [e["id"] for e in answer["effects"]],
        "begun_at": begun, "values": {name: f.value for name, f in fits.items()},
        "value": fit.value, "criterion_gain": data.base.bic - fit.bic,
        "strain": strain(data.setting, fit),
        "parameters": {t.id: _told(t) for t in fit.terms},
        "rig": {n: getattr(fit.rig, n) for n in data.setting.coordinates.free},
        "base_five_second_rms": data.errors(data.base), "five_second_rms": data.errors(fit),
        "cpu_s": time.process_time() - began,
    }  # fmt: skip


def _told(term: Term) -> dict[str, float]:
    assert isinstance(term.source, Named)
    return dict(zip((p.name for p in term.source.effect.parameters), term.q.tolist(), strict=True))


def one(cases: Path, out: Path, answer: Mapping[str, Any]) -> tuple[str, str | None]:
    """Do a case that is not done; its name, and why it has no oracle."""
    case = cases / answer["case"]
    path = out / f"{answer['case']}.json"
    if path.exists():
        return answer["case"], None
    try:
        found = refit(answer, case)
    except (InputError, np.linalg.LinAlgError) as error:
        return answer["case"], str(error)
    if not all(math.isfinite(v) for v in found["five_second_rms"].values()):
        return answer["case"], "its predictions leave all bounds"
    write_text(path, json.dumps(found, indent=1) + "\n")
    return answer["case"], None


def main(
    cases: Annotated[Path, typer.Option(help="Folder of the cases.")],
    answers: Annotated[Path, typer.Option(help="Folder of the sealed answers.")],
    out: Annotated[Path, typer.Option(help="Folder of the oracles.")],
    seal: Annotated[str | None, typer.Option(help="Digest that was published.")] = None,
    jobs: JobsOption = None,
    engine: EngineOption = EngineKind.LOCAL,
    address: AddressOption = None,
    first: Annotated[int, typer.Option(help="Only so many cases; 0 for all.")] = 0,
) -> None:
    """Refit the oracles that are not there yet."""
    try:
        told = [a for a in open_answers(answers, seal).values() if has_oracle(a)][: first or None]
        make_folder(out)
        runs_at = engine_of(jobs, engine, address)
    except InputError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from error
    once = functools.partial(one, cases.resolve(), out.resolve())
    with counted("oracles") as watch:
        done = run(once, told, runs_at, name=lambda a: a["case"], progress=watch)
        failed = [d for d in done if d[1]]
    print(f"{len(told)} cases have the tool's structure, {len(failed)} of them no oracle")
    for name, why in sorted(failed):
        print(f"{name}: {why}")


if __name__ == "__main__":
    typer.run(main)
