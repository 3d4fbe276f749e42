"""The demo's hidden effect: a brake disc that is not flat, found from two recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from drill_env.parameters import Rig

HIDDEN = {"id": "brake_runout", "runout": 0.08, "phase": 0.7, "order": 1.0}
"""What the recordings' rig has and the rig that the diagnosis starts from has not."""

_SECONDS = 30.0


def find_hidden_effect(out: Path, report: Callable[[str], bool | None]) -> dict[str, Any]:
    """Simulate two recordings of a rig with the effect, diagnose them and write the report.

    Args:
        out: folder for recordings and report.
        report: is told what is being done.

    Returns:
        What was hidden and what the diagnosis says.
    """
    from drill_env._files import make_folder
    from drill_env.diagnosis.diagnose import diagnose
    from drill_env.diagnosis.options import DiagnosisOptions
    from drill_env.report.diagnosis_files import diagnosis_texts, write_diagnosis

    make_folder(out)
    fit, held = (_record(out / f"run-{seed}.csv", seed) for seed in (1, 2))
    options = DiagnosisOptions(most=1)
    found = diagnose([fit], Rig.paper(), [held], options=options, report=report)
    report("writing the report")
    write_diagnosis(diagnosis_texts(found), out)
    return {"hidden": HIDDEN, "page": out / "index.html", **found.result.as_dict()}


def _record(path: Path, seed: int) -> Any:
    from drill_env._tables import write_table
    from drill_env.cli.simulate_command import run_table
    from drill_env.integrator import sampled_voltage, simulate
    from drill_env.recordings import read_recording
    from drill_env.recordings.signals import Signal, signal_samples

    rig = Rig.paper().replace(effects=(HIDDEN,))
    t, u = signal_samples(Signal("quasi-random", seconds=_SECONDS, seed=seed))
    run = simulate(rig, sampled_voltage(t, u), float(t[-1]), t_eval=t)
    write_table(run_table(run, 8192), path)
    return read_recording(path, need=("u", "theta_u", "theta_l"))


def detective_lines(found: dict[str, Any]) -> Iterator[str]:
    """What the demo prints of it."""
    hidden = found["hidden"]
    yield f"3. Diagnosis of two recordings whose rig hides {hidden['id']}:"
    for effect in found["effects"]:
        chance = f"probability {effect['probability']:.2f}"
        yield f"   found {effect['id']}, {chance}: {effect['meaning']}"
        for name, number in effect["parameters"].items():
            unit = "" if number["unit"] == "1" else f" {number['unit']}"
            true = f"; true {hidden[name]:g}" if name in hidden else ""
            yield (
                f"   {name} = {number['value']:.4f}{unit} "
                f"({number['low']:.4f} to {number['high']:.4f}){true}"
            )
    for sentence in found["sentences"]:
        if sentence.startswith("On held-out recordings"):
            yield f"   {sentence}"
    yield f"   -> {found['page']}"
