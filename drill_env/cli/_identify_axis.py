"""Identification of one inertia on the command line: what is read, shown and written."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from drill_env._errors import InputError
from drill_env.cli._common import output_file, print_json, progress_bar, remarks, show, tell
from drill_env.parameters import SYMBOLS, Rig, save_rig

if TYPE_CHECKING:
    from drill_env.identification.asymmetry import AxisModel, OffsetSplit
    from drill_env.identification.closed_loop import ClosedLoopResult
    from drill_env.identification.inverse_dynamics import InverseOptions
    from drill_env.identification.one_inertia import OneInertiaResult
    from drill_env.recordings import Recording


@dataclass(frozen=True, slots=True)
class AxisFit:
    """Everything that was asked for.

    Attributes:
        fit: recordings to fit.
        holdout: recordings to judge by.
        mapping: column maps.
        gain: force or torque per volt.
        gain_column: number in the first recording that holds it.
        asymmetric: whether friction is apart for each direction.
        options: how derivatives are taken.
        closed_loop: whether the simulated closed loop is fitted.
        reference: column of the position asked for.
        disturbance: column of a voltage beside the position law.
        compare: whether models with and without asymmetry are compared.
        out: rig file to write.
        as_json: whether one JSON document is printed.
    """

    fit: Sequence[Path]
    options: InverseOptions
    holdout: Sequence[Path] = ()
    mapping: Sequence[str] = ()
    gain: float | None = None
    gain_column: str | None = None
    asymmetric: bool = False
    closed_loop: bool = False
    reference: str | None = None
    disturbance: str | None = None
    compare: bool = False
    out: Path | None = None
    as_json: bool = False


def identify_axis(asked: AxisFit) -> None:
    """Fit, judge, show and write."""
    if asked.out is not None:
        output_file(asked.out)
    _check_loop(asked)
    with remarks():
        fitted, held = _read(asked.fit, asked.mapping), _read(asked.holdout, asked.mapping)
        gain = _gain(asked.gain, asked.gain_column, fitted)
        if asked.closed_loop:
            _identify_closed_loop(asked, fitted, held, gain)
        else:
            _identify_inverse(asked, fitted, held, gain)


def _identify_inverse(
    asked: AxisFit, fitted: list[Recording], held: list[Recording], gain: float | None
) -> None:
    from drill_env.identification.asymmetry import split_offset
    from drill_env.identification.one_inertia import identify_one_inertia

    result = identify_one_inertia(
        fitted, gain, holdout=held, asymmetric=asked.asymmetric, options=asked.options
    )
    rig = _saved_rig(result, asked.out)
    split = split_offset(fitted, result.gain, asked.options) if asked.asymmetric else None
    if asked.as_json:
        offset = None if split is None else split.as_dict()
        rest = {**_rig_document(rig, asked.out), "offset": offset}
        print_json({"model": "one_inertia", **result.as_dict(), **rest})
        return
    title = f"One inertia, gain {result.gain:.6g} per volt"
    _show_values(title, result.estimates, result.standard_errors)
    _show_errors(result)
    _tell_rest(split, asked.out)


def _identify_closed_loop(
    asked: AxisFit, fitted: list[Recording], held: list[Recording], gain: float | None
) -> None:
    from drill_env.identification.asymmetry import split_offset
    from drill_env.identification.closed_loop import ASYMMETRIC, OFFSET, identify_closed_loop
    from drill_env.identification.position_law import find_position_law

    assert asked.reference is not None
    law = find_position_law(fitted, asked.reference, asked.disturbance)
    if asked.disturbance and not any(asked.disturbance in r.extra for r in (*fitted, *held)):
        raise InputError(f"--disturbance {asked.disturbance}: no recording has that column")
    free = ASYMMETRIC if asked.asymmetric else OFFSET
    result = identify_closed_loop(fitted, gain, law, holdout=held, free=free)
    if asked.out is not None:
        save_rig(result.rig, asked.out)
    km = result.rig.km
    split = split_offset(fitted, km, asked.options) if asked.asymmetric or asked.compare else None
    models = _compared(fitted, held, result) if asked.compare else ()
    if asked.as_json:
        print_json({
            "model": "one_inertia_closed_loop", **result.as_dict(),
            **_rig_document(result.rig, asked.out),
            "offset": None if split is None else split.as_dict(),
            "models": [m.as_dict() for m in models],
        })  # fmt: skip
        return
    typer.echo(
        f"position law: kp {law.kp:.6g}, kv {law.kv:.6g}, velocity over {law.span} samples, delay "
        f"{law.delay}; leaves {law.left:.2%} of the voltage"
    )
    values = {name: getattr(result.rig, name) for name in result.free}
    title = f"One inertia in closed loop, gain {km:.6g} per volt"
    _show_values(title, values, result.standard_errors)
    _show_errors(result)
    _show_models(models)
    _tell_rest(split, asked.out)


def _compared(
    fitted: list[Recording], held: list[Recording], result: ClosedLoopResult
) -> tuple[AxisModel, ...]:
    from drill_env.identification.asymmetry import compare_asymmetry

    with progress_bar() as bar:
        task = bar.add_task("models", total=None)
        return compare_asymmetry(
            fitted, result.rig.km, result.law, holdout=held,
            progress=lambda name, done, total: bar.update(
                task, description=name, completed=done, total=total
            ),
        )  # fmt: skip


def _check_loop(asked: AxisFit) -> None:
    if asked.closed_loop and asked.reference is None:
        raise InputError(
            "--closed-loop needs the position that was asked for: --reference COLUMN[:UNIT]"
        )
    given = {
        "--reference": asked.reference is not None,
        "--disturbance": asked.disturbance is not None,
        "--compare": asked.compare,
    }
    for option, present in given.items():
        if present and not asked.closed_loop:
            raise InputError(f"{option} belongs to --closed-loop: give that too")


def _gain(gain: float | None, column: str | None, fitted: list[Recording]) -> float | None:
    from drill_env.identification.drive import check_axis, torque_driven

    check_axis(fitted)
    if gain is not None and column is not None:
        raise InputError("--gain and --gain-column are both given; give one of them")
    if torque_driven(fitted):
        if gain is not None or column is not None:
            raise InputError(f"{fitted[0].source} is driven by a measured torque: leave --gain out")
        return 1.0
    return fitted[0].constant(column) if column is not None else gain


def _read(paths: Sequence[Path], mapping: Sequence[str]) -> list[Recording]:
    from drill_env.recordings import parse_map, read_recording

    columns = parse_map(mapping)
    return [read_recording(path, columns, need=("u", "theta_u")) for path in paths]


def _saved_rig(result: OneInertiaResult, out: Path | None) -> Rig | None:
    """The rig, written if asked for; none and a warning where the estimates make no rig."""
    try:
        rig = result.rig
    except InputError as error:
        if out is not None:
            raise
        warnings.warn(str(error), stacklevel=1)
        return None
    if out is not None:
        save_rig(rig, out)
    return rig


def _rig_document(rig: Rig | None, out: Path | None) -> dict[str, Any]:
    table = None if rig is None else {n: getattr(rig, n) for n in SYMBOLS} | {"inertias": 1}
    return {"rig": table, "rig_file": None if out is None else str(out)}


def _show_values(title: str, values: Mapping[str, float], deviations: Mapping[str, float]) -> None:
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for name in ("parameter", "estimate", "std. error"):
        table.add_column(name, justify="left" if name == "parameter" else "right")
    for name, value in values.items():
        table.add_row(name, f"{value:.6g}", f"{deviations[name]:.2g}")
    show(table)


def _show_errors(result: OneInertiaResult | ClosedLoopResult) -> None:
    from rich.table import Table

    table = Table(title="Relative force error", title_justify="left")
    table.add_column("")
    table.add_column("%", justify="right")
    for label, found in (("fit", result.fit_errors), ("held out", result.holdout_errors)):
        for source, share in found.items():
            table.add_row(f"{label}: {Path(source).name}", f"{100 * share:.3f}")
    show(table)


def _show_models(models: Sequence[AxisModel]) -> None:
    from rich.table import Table

    if not models:
        return
    table = Table(title="Friction models, smallest criterion first", title_justify="left")
    held = [Path(source).name for source in models[0].found.holdout_errors]
    table.add_column("model")
    for name in ("dTsu", "dbu", "BIC - lowest", "fit %", *(f"{h} %" for h in held)):
        table.add_column(name, justify="right")
    for model in models:
        rig, found = model.found.rig, model.found
        errors = [found.fit_error, *found.holdout_errors.values()]
        table.add_row(
            model.name, f"{rig.dTsu:.4g}", f"{rig.dbu:.4g}", f"{model.bic - models[0].bic:.1f}",
            *(f"{100 * e:.3f}" for e in errors),
        )  # fmt: skip
    show(table)


def _tell_rest(split: OffsetSplit | None, out: Path | None) -> None:
    if split is not None:
        typer.echo(split.text)
    if out is not None:
        tell(f"rig file: {out}")
