"""Identification of the whole rig on the command line: what is read, shown and written."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from drill_env._errors import InputError
from drill_env.cli._common import (
    output_file,
    output_folder,
    print_json,
    progress_bar,
    remarks,
    rig_from,
    show,
    tell,
)
from drill_env.cli._recordings import look_over, read_set
from drill_env.parameters import SYMBOLS, Rig, save_rig

if TYPE_CHECKING:
    from drill_env.identification.estimate import Estimate, FitOptions
    from drill_env.identification.laws import LawComparison
    from drill_env.identification.profile import Profile
    from drill_env.identification.stages import StageLink
    from drill_env.identification.validation import Validation
    from drill_env.recordings import RecordingSet


@dataclass(frozen=True, slots=True)
class RigFit:
    """Everything that was asked for.

    Attributes:
        fit: recordings, or one folder of them.
        stage1: recordings of the upper disc alone.
        holdout: recordings to judge by.
        mapping: column maps.
        rig: file of the rig to start from.
        free: names of the free parameters, comma-separated.
        fixed, priors, bounds: NAME=VALUE, NAME=MEAN:SD and NAME=LOW:HIGH.
        link: how stage 2 takes stage 1.
        profile: names of parameters for a profile likelihood, comma-separated.
        laws: whether the friction laws are compared.
        out: rig file to write.
        estimate: estimate file to write.
        report: folder of the validation page.
        as_json: whether one JSON document is printed.
    """

    fit: Sequence[Path]
    options: FitOptions
    stage1: Sequence[Path] = ()
    holdout: Sequence[Path] = ()
    mapping: Sequence[str] = ()
    rig: Path | None = None
    free: str | None = None
    fixed: Sequence[str] = ()
    priors: Sequence[str] = ()
    bounds: Sequence[str] = ()
    link: StageLink = "prior"
    profile: str | None = None
    laws: bool = False
    out: Path | None = None
    estimate: Path | None = None
    report: Path | None = None
    as_json: bool = False


@dataclass(frozen=True, slots=True)
class RigFound:
    """Everything that was found."""

    start: Rig
    first: Estimate | None
    estimate: Estimate
    profiles: Sequence[Profile]
    validations: Sequence[Validation]
    laws: LawComparison | None
    residual_shape: Sequence[str] = field(default_factory=list)


def identify_rig(asked: RigFit) -> None:
    """Fit, judge, show and write."""
    for path in (asked.out, asked.estimate):
        if path is not None:
            output_file(path)
    if asked.report is not None:
        output_folder(asked.report)
    with remarks():
        found = _find(asked)
        _write(asked, found)
    if asked.as_json:
        print_json(_document(asked, found))
    else:
        _show(asked, found)


def _find(asked: RigFit) -> RigFound:
    from drill_env.identification.knowledge import knowledge_of, residual_shape
    from drill_env.identification.laws import compare_laws
    from drill_env.identification.profile import profile
    from drill_env.identification.validation import validate_estimate

    start = rig_from(asked.rig)
    recordings = _recordings(asked, None if asked.rig is None else start)
    fixed = {name: value for name, (value,) in pairs(asked.fixed, "--fix", 1).items()}
    with progress_bar() as bar:
        task = bar.add_task("fit", total=None)
        first, estimate = _fit(
            asked, recordings, start, fixed,
            lambda number, i, value: bar.update(
                task, description=f"start {number + 1}, iteration {i}, -2 log L {value:.1f}"
            ),
        )  # fmt: skip
        profiles = []
        for name in _names(asked.profile):
            bar.update(task, description=f"profile of {name}")
            profiles.append(profile(estimate, name))
        bar.update(task, description="validation")
        validations = validate_estimate(estimate, recordings.holdout)
        laws = None
        if asked.laws:
            bar.update(task, description="friction laws")
            laws = compare_laws(
                recordings.fit, estimate.rig, fixed=fixed, holdout=recordings.holdout,
                options=asked.options,
            )  # fmt: skip
    return RigFound(
        start, first, estimate, profiles, validations, laws, residual_shape(knowledge_of(estimate))
    )


def _fit(
    asked: RigFit, recordings: RecordingSet, start: Rig, fixed: dict[str, float], report: Any
) -> tuple[Estimate | None, Estimate]:
    from drill_env.identification.estimate import identify
    from drill_env.identification.prior import Prior
    from drill_env.identification.stages import identify_stages

    if recordings.stage1:
        if asked.priors or asked.bounds or asked.free:
            raise InputError(
                "--free, --prior and --bounds do not go with stage 1 recordings; give one stage"
            )
        return identify_stages(
            recordings.stage1, recordings.fit, start, fixed=fixed, link=asked.link,
            options=asked.options, progress=report,
        )  # fmt: skip
    priors = pairs(asked.priors, "--prior", 2)
    bounds = pairs(asked.bounds, "--bounds", 2)
    return None, identify(
        recordings.fit, start, free=_names(asked.free) or None, fixed=fixed,
        prior=Prior.independent({n: (a, b) for n, (a, b) in priors.items()}),
        bounds={n: (a, b) for n, (a, b) in bounds.items()}, options=asked.options,
        progress=report,
    )  # fmt: skip


def _recordings(asked: RigFit, rig: Rig | None) -> RecordingSet:
    """The recordings, each looked over for signs, units and swapped columns."""
    from drill_env.identification.drive import torque_driven

    found = read_set(asked.fit, asked.mapping, asked.holdout, asked.stage1)
    torque_driven([*found.stage1, *found.fit, *found.holdout])
    look_over(found, rig)
    for recording in (*found.fit, *found.holdout):
        if asked.options.method == "multiple_shooting" and found.of(recording).closed_loop:
            text = (
                f"{recording.source}: closed loop; multiple shooting is biased by it, "
                "--method prediction_error is not"
            )
            warnings.warn(text, stacklevel=1)
    return found


def _names(text: str | None) -> list[str]:
    return [part.strip() for part in (text or "").split(",") if part.strip()]


def pairs(texts: Sequence[str], option: str, count: int) -> dict[str, list[float]]:
    """NAME=A or NAME=A:B of a repeatable option."""
    found: dict[str, list[float]] = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            values = [float(part) for part in value.split(":")]
        except ValueError:
            values = []
        if len(values) != count or name not in SYMBOLS:
            form = "VALUE" if count == 1 else ("MEAN:SD" if option == "--prior" else "LOW:HIGH")
            raise InputError(
                f"{option} {text}: give NAME={form} with a name out of {', '.join(SYMBOLS)}"
            )
        if name in found:
            raise InputError(f"{option} {text}: {name} is given twice; give it once")
        found[name] = values
    return found


def _write(asked: RigFit, found: RigFound) -> None:
    from drill_env.identification.estimate_file import save_estimate

    if asked.out is not None:
        save_rig(found.estimate.rig, asked.out)
    if asked.estimate is not None:
        save_estimate(found.estimate, asked.estimate)
    if asked.report is not None:
        from drill_env.report.validation_page import save_validation_page

        asked.report.mkdir(parents=True, exist_ok=True)
        save_validation_page(
            found.estimate, found.validations, asked.report / "index.html", laws=found.laws
        )
        save_estimate(found.estimate, asked.report / "estimate.json")
        save_rig(found.estimate.rig, asked.report / "rig.toml")


def _document(asked: RigFit, found: RigFound) -> dict[str, Any]:
    from drill_env.identification.estimate_file import estimate_document

    document = estimate_document(found.estimate)
    document |= {
        "ratios": ratios(found.estimate),
        "residual_shape": list(found.residual_shape),
        "profiles": [
            {"name": p.name, "low": p.low, "high": p.high, "level": p.level,
             "values": p.values, "rise": p.rise}
            for p in found.profiles
        ],
        "fit": [v.as_dict() for v in found.validations[: len(found.estimate.noise)]],
        "holdout": [v.as_dict() for v in found.validations[len(found.estimate.noise) :]],
        "laws": None if found.laws is None else found.laws.as_dict(),
        "stage1": None if found.first is None else estimate_document(found.first),
        "rig_file": None if asked.out is None else str(asked.out),
        "report": None if asked.report is None else str(asked.report / "index.html"),
    }  # fmt: skip
    return document


def ratios(estimate: Estimate) -> dict[str, float]:
    """Each torque over the given one: what volts and angles tell without it."""
    torques = [n for n in SYMBOLS if n not in ("beta1", "beta2")]
    given = [n for n in torques if n not in estimate.free and getattr(estimate.rig, n) != 0.0]
    if len(given) != 1:
        return {}
    scale = getattr(estimate.rig, given[0])
    return {
        f"{n}/{given[0]}": getattr(estimate.rig, n) / scale for n in torques if n in estimate.free
    }


def _show(asked: RigFit, found: RigFound) -> None:
    from rich.table import Table

    estimate = found.estimate
    intervals = estimate.intervals()
    table = Table(title="Rig", title_justify="left")
    table.add_column("parameter")
    for name in ("estimate", "95 % from", "to", "start"):
        table.add_column(name, justify="right")
    for name in SYMBOLS:
        value, start = getattr(estimate.rig, name), getattr(found.start, name)
        ends = [f"{v:.5g}" for v in intervals[name]] if name in intervals else ["given", ""]
        table.add_row(name, f"{value:.6g}", *ends, f"{start:.5g}")
    show(table)
    if not estimate.converged:
        tell("warning: the fit stopped before it converged; give --starts 5 or a nearer --rig")
    if found.profiles:
        _show_profiles(found.profiles)
    _show_validations(found)
    if found.laws is not None:
        typer.echo(found.laws.conclusion)
    for line in found.residual_shape:
        typer.echo(line)
    for label, path in (("rig file", asked.out), ("estimate", asked.estimate)):
        if path is not None:
            tell(f"{label}: {path}")
    if asked.report is not None:
        tell(f"report: {asked.report / 'index.html'}")


def _show_profiles(profiles: Sequence[Profile]) -> None:
    from rich.table import Table

    table = Table(title="Profile likelihood", title_justify="left")
    for name in ("parameter", "95 % from", "to"):
        table.add_column(name)
    for p in profiles:
        table.add_row(p.name, f"{p.low:.5g}", f"{p.high:.5g}")
    show(table)


def _show_validations(found: RigFound) -> None:
    from rich.table import Table

    table = Table(title="Error in % of each channel's range", title_justify="left")
    table.add_column("recording")
    for name in ("channel", "free run", "5 s prediction"):
        table.add_column(name, justify="right")
    table.add_column("residuals")
    for i, validation in enumerate(found.validations):
        label = "fit" if i < len(found.estimate.noise) else "held out"
        result = validation.replay
        for name, error in result.errors.items():
            predicted = result.prediction_errors.get(name)
            table.add_row(
                f"{label}: {validation.name}", name, f"{error.percent:.3f}",
                f"{predicted.percent:.3f}" if predicted else "", validation.verdict,
            )  # fmt: skip
    show(table)
