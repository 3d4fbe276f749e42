"""Estimates on disk: JSON that people, the report and the design of experiments read."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from drill_env._documents import read_json
from drill_env._errors import InputError
from drill_env._files import write_text
from drill_env._types import PathLike
from drill_env.identification.coordinates import free_names
from drill_env.identification.estimate import Estimate
from drill_env.identification.knowledge import ANGLES, Knowledge, knowledge_of, typical_noise
from drill_env.identification.noise import NoiseModel
from drill_env.parameters import SYMBOLS, Rig
from drill_env.recordings import Recording

FORMAT = "drill-env estimate"
VERSION = 1
_LEVEL = 0.95


def estimate_document(estimate: Estimate, level: float = _LEVEL) -> dict[str, Any]:
    """An estimate as plain data; infinity becomes None.

    Args:
        estimate: from `identify`.
        level: probability of the intervals.
    """
    rig, point, known = estimate.rig, estimate.point, knowledge_of(estimate)
    options = dataclasses.asdict(estimate.options)
    return {
        "format": FORMAT,
        "version": VERSION,
        "rig": dataclasses.asdict(rig),
        "free": list(estimate.free),
        "values": {name: getattr(rig, name) for name in estimate.free},
        "level": level,
        "intervals": estimate.intervals(level),
        "covariance": estimate.covariance.tolist(),
        "information": known.information.tolist(),
        "noise": [
            model.named(velocities=bool(samples.recording.velocities()))
            for model, samples in zip(estimate.noise, estimate.problem.samples, strict=True)
        ],
        "encoder_steps": dict(known.quanta),
        "value": point.value,
        "bic": estimate.bic,
        "samples": point.samples,
        "converged": estimate.converged,
        "iterations": estimate.iterations,
        "start_values": estimate.start_values.tolist(),
        "options": {n: None if v == math.inf else v for n, v in options.items()},
        "recordings": [_summary(s.recording) for s in estimate.problem.samples],
    }


def save_estimate(estimate: Estimate, path: PathLike) -> None:
    """Write an estimate; `load_knowledge` reads back what the next experiment needs."""
    text = json.dumps(estimate_document(estimate), indent=2, allow_nan=False)
    write_text(Path(path), text + "\n")


def load_knowledge(path: PathLike) -> Knowledge:
    """Read what an estimate file knows.

    Raises:
        InputError: the file is missing, is no estimate, or holds a bad value.
    """
    path = Path(path)
    document = read_json(path, f"estimate {path}", _REMEDY)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise InputError(f"estimate {path} is not an estimate of drill-env; {_REMEDY}")
    if document.get("version") != VERSION:
        raise InputError(
            f"estimate {path} has version {document.get('version')!r}, and this program reads "
            f"{VERSION}; {_REMEDY}"
        )
    try:
        return _knowledge(document)
    except KeyError as error:
        raise InputError(f"estimate {path} lacks {error}; {_REMEDY}") from error
    except (TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        raise InputError(f"estimate {path}: {error}; {_REMEDY}") from error


_REMEDY = "write it with `drill-env identify ... --estimate estimate.json`"


def _knowledge(document: dict[str, Any]) -> Knowledge:
    table = dict(document["rig"])
    rig = Rig(**{**table, "effects": tuple(table.get("effects", ()))})
    fixed = {n: getattr(rig, n) for n in SYMBOLS if n not in document["free"]}
    free = free_names(document["free"], rig, fixed, scaled=True)
    information = np.array(document["information"], dtype=float)
    if information.shape != (len(free), len(free)) or not np.isfinite(information).all():
        raise InputError(f"information is no {len(free)} x {len(free)} matrix of numbers")
    if not document["noise"] or not document["recordings"]:
        raise InputError("noise or recordings is empty")
    if any(entry.get("drive", "voltage") != "voltage" for entry in document["recordings"]):
        raise InputError("its recordings have no voltage, and what is planned is one")
    if not document["encoder_steps"] and any(e.get("velocities") for e in document["recordings"]):
        raise InputError("its recordings hold velocities only, and what is planned is an angle's")
    quanta = {str(name): float(step) for name, step in document["encoder_steps"].items()}
    if not quanta or not set(quanta) <= set(ANGLES):
        raise InputError("encoder_steps names other angles than theta_u and theta_l")
    return Knowledge(
        rig=rig,
        free=free,
        information=information,
        noise=typical_noise([NoiseModel(**model) for model in document["noise"]]),
        quanta=quanta,
        sources=tuple(str(entry["source"]) for entry in document["recordings"]),
    )


def _summary(recording: Recording) -> dict[str, Any]:
    return {
        "source": recording.source,
        "seconds": recording.duration,
        "rate": recording.rate,
        "samples": len(recording),
        "angles": list(recording.angles()),
        **({"velocities": list(recording.velocities())} if recording.velocities() else {}),
        **({"drive": recording.drive} if recording.drive != "voltage" else {}),
        "quanta": dict(recording.quanta),
    }
