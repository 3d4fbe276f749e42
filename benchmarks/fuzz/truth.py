"""Random rigs beside a reference: `python -m benchmarks.fuzz.truth --rigs 300 --seed 1`.

The speeds of both discs are compared a hundred times a second with those that SciPy's DOP853 finds
between located events (`benchmarks.effects_reference`, which shares no code with the package).
Where they differ by more than `BAR`, both are solved again with smaller errors: two that
converge to one motion then agree. Where they still do not, the motion itself must magnify
rounding as much: see `possible`.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.progress import track

from benchmarks.effects_reference.settings import MOVING
from benchmarks.effects_reference.solver import reference
from benchmarks.fuzz.draws import Case, draw_moving
from benchmarks.fuzz.forked import forked
from drill_env._types import FloatArray
from drill_env.effects import LIBRARY
from drill_env.integrator import Trajectory, simulate

BAR = 1e-7
"""Largest difference of a speed that counts as none, rad/s."""
HERTZ = 100
# Relative tolerances of ours and of the reference, whose absolute ones are a hundredth and a tenth,
# and its longest step (s). SciPy takes no smaller tolerance than the last.
USUAL, FINE = (1e-12, 1e-12, 0.02), (1e-14, 2.3e-14, 0.005)
PIECES = 200
"""Parts of a run between which what is magnified is followed."""
PATIENCE = 300.0
"""Seconds of CPU after which the reference is given up."""

Solver = tuple[float, float, float]


def ours(case: Case, rtol: float) -> Trajectory:
    """What the package finds."""
    seconds = float(case.voltage.breaks[-1])
    t = np.linspace(0.0, seconds, round(HERTZ * seconds) + 1)
    return simulate(
        case.rig, case.voltage, seconds, t_eval=t, initial=case.start, rtol=rtol, atol=0.01 * rtol
    )


def truth(case: Case, rtol: float, cap: float) -> FloatArray:
    """What the reference finds."""
    seconds = float(case.voltage.breaks[-1])
    starts, volts = case.voltage.breaks[:-1].tolist(), case.voltage.pieces[:, 0].tolist()
    t = np.linspace(0.0, seconds, round(HERTZ * seconds) + 1)
    effects = [dict(effect) for effect in case.rig.effects]
    plain, start = case.rig.replace(effects=()), case.start.tolist()
    return reference(
        plain, effects, list(zip(starts, volts, strict=True)), seconds, t, start, rtol=rtol,
        atol=0.1 * rtol, cap=cap,
    )  # fmt: skip


def apart(case: Case, solver: Solver) -> FloatArray:
    """Larger difference of both discs' speeds at each sample, rad/s, shape (n,)."""
    run, known = ours(case, solver[0]), truth(case, *solver[1:])
    return np.abs(run.state - known)[:, 1:3].max(axis=1)


def possible(case: Case, solver: Solver) -> FloatArray:
    """How far two right solutions may be apart at the samples, rad/s, shape (n,).

    A step of either errs by its tolerances at most, and what it errs by goes on as the exact
    derivative D of the later state by the state then, to first order: the sum over the parts i
    before of |D(t, t_i)| n_i e_i, where e_i are the tolerances of both at the largest state in the
    part, and n_i its steps. What it once was it stays here.
    """
    run = ours(case, solver[0])
    seconds, inner = float(case.voltage.breaks[-1]), run.inner.shape[1]
    edges = np.linspace(0.0, seconds, PIECES + 1)
    # Derivatives of the present state by that at the end of each part before, and errors there.
    since, errors = np.zeros((0, 4 + inner, 4 + inner)), np.zeros((0, 4 + inner))
    found = np.zeros(len(run.t))
    state, modes, memory = case.start, None, None
    for begin, end in zip(edges[:-1], edges[1:], strict=True):
        part = simulate(
            case.rig, case.voltage, end - begin, t_start=float(begin), initial=state, modes=modes,
            inner=memory, t_eval=np.linspace(begin, end, 11), rtol=solver[0],
            atol=0.01 * solver[0], sensitivity=True,
        )  # fmt: skip
        matrix = part.final_sensitivity if inner else part.sensitivity[-1]
        columns = [*range(4), *range(matrix.shape[1] - inner, matrix.shape[1])]
        size = np.abs(np.hstack([part.state, part.inner])).max(axis=0)
        error = (solver[0] + solver[1]) * size + 0.01 * solver[0] + 0.1 * solver[1]
        steps = max(part.steps, (end - begin) / solver[2])
        since = np.concatenate([matrix[:, columns] @ since, np.eye(4 + inner)[None]])
        errors = np.concatenate([errors, steps * error[None]])
        grown = np.einsum("kij,kj->i", np.abs(since), errors)[1:3].max()
        # Within a part it may be more than at its end: a disc may stop there.
        later = run.t > begin
        found[later] = np.maximum(found[later], grown)
        state, modes, memory = part.final_state, part.final_modes, part.final_inner
    return found


def verdict(case: Case) -> dict[str, Any]:
    """How far apart, and `fault` where nothing explains it."""
    usual = float(apart(case, USUAL).max())
    if usual <= BAR:
        return {"fault": "", "sort": "agrees", "apart": usual}
    gaps = apart(case, FINE)
    known: dict[str, Any] = {"apart": usual, "fine": float(gaps.max())}
    if known["fine"] <= BAR:
        return {"fault": "", "sort": "agrees when solved finer", **known}
    bound = possible(case, FINE)
    known["possible"] = float(bound[gaps.argmax()])
    if (gaps <= np.maximum(BAR, bound)).all():
        return {"fault": "", "sort": "magnifies rounding", **known}
    return {"fault": "apart", "sort": "apart", **known}


def judged(case: Case) -> dict[str, Any]:
    """`verdict` in a process of its own, ended where the reference takes too long."""
    found = forked(lambda: verdict(case), PATIENCE)
    return {"sort": found["fault"], **found}


def main(
    rigs: Annotated[int, typer.Option(help="how many")] = 300,
    seed: Annotated[int, typer.Option(help="of the draws")] = 1,
    first: Annotated[int, typer.Option(help="number of the first one")] = 0,
    seconds: Annotated[float, typer.Option(min=1.0, help="of each run")] = 20.0,
    effects: Annotated[bool, typer.Option(help="one effect each, in turn")] = False,
    out: Annotated[
        Path | None, typer.Option(help="file for all that was found, JSON lines")
    ] = None,
) -> None:
    """Draw, solve twice, compare, count."""
    _ = [effect.kernel.address for effect in LIBRARY.values()]
    count: Counter[str] = Counter()
    worst, failed = 0.0, False
    for number in track(range(first, first + rigs), description="rigs"):
        name = MOVING[number % len(MOVING)] if effects else None
        case = draw_moving(seed, number, seconds, name)
        found = {"number": number, "effect": name, "law": case.rig.friction, **judged(case)}
        count[found["sort"]] += 1
        worst = max(worst, found.get("fine", found.get("apart", 0.0)))
        failed = failed or bool(found["fault"])
        if found["sort"] != "agrees":
            print(json.dumps(found), flush=True)
        if out is not None:
            with out.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(found) + "\n")
    for sort, many in count.most_common():
        print(f"{sort:26} {many}")
    print(f"at most {worst:.1e} rad/s apart, as fine as each was solved")
    raise typer.Exit(1 if failed else 0)


if __name__ == "__main__":
    typer.run(main)
