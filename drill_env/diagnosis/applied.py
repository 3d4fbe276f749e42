"""A recording as the filter reads it when what acts beside the rig's parameters is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.late_readings import on_time, telling
from drill_env.diagnosis.terms import Named, Shape, Term, at_rest, late_disc
from drill_env.effects import LIBRARY
from drill_env.effects.along import Motion, responses_along
from drill_env.effects.declared import Declared, bundled, declared
from drill_env.identification.known_loads import times_inertia, with_added_inertia
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig
from drill_env.recordings import Recording


@dataclass(frozen=True, slots=True)
class Tabled(Shape):
    """A table of the rig file: a function whose values are known.

    Attributes:
        effects: of a rig with it alone.
    """

    effects: tuple[Mapping[str, Any], ...]

    def response(self, q: FloatArray, rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """The table's torques and reading errors."""
        return responses_along(declared(rig.replace(effects=self.effects)), rig, motion)


def _no_numbers(rig: Rig, motion: Motion) -> tuple[None, None]:
    return None, None


def effects_of(rig: Rig) -> tuple[Term, ...]:
    """The effects of a rig's file as terms, in their order."""
    terms = []
    for entry in rig.effects:
        effect = LIBRARY.get(str(entry["id"]))
        if effect is None:
            component, on, sort = (str(entry[k]) for k in ("component", "depends_on", "sort"))
            table = Tabled("table", component, on, sort, (), _no_numbers, (entry,))
            terms.append(Term(table, np.zeros(0)))
            continue
        numbers = np.array([float(entry[p.name]) for p in effect.parameters])
        within = effect.refined_within or effect.holds
        terms.append(Term(Named(effect, within=within), numbers))
    return tuple(terms)


def as_heavy(terms: Sequence[Term], rig: Rig, recording: Recording) -> tuple[Term, ...]:
    """Terms as they act in a recording in which something known was bolted on a disc."""
    if recording.added_inertia_u == 0.0 and recording.added_inertia_l == 0.0:
        return tuple(terms)
    found = []
    for term in terms:
        source = term.source
        if isinstance(source, Named) and source.effect.heavier is not None:
            times = times_inertia(rig, recording, source.effect.equation)
            term = Term(replace(source, times=times), term.q)
        found.append(term)
    return tuple(found)


def acting(terms: Sequence[Term]) -> Declared:
    """Those of the terms that act at the filter's own state."""
    return bundled(
        [
            (t.source.effect, t.source.acts_by(t.q))
            for t in terms
            if isinstance(t.source, Named) and at_rest(t)
        ]
    )


def with_terms(samples: Samples, terms: tuple[Term, ...], rig: Rig, motion: Motion) -> Samples:
    """The recording as the filter reads it when the terms and the rig's own effects are known.

    What a late encoder says of the last moments is not there to be read: those angles are missing.
    """
    loads, angles, repeats = samples.loads.copy(), samples.angles.copy(), samples.repeats.copy()
    every = as_heavy((*effects_of(rig), *terms), rig, samples.recording)
    rig = with_added_inertia(rig, samples.recording)
    for term in sorted(every, key=lambda t: late_disc(t) is None):
        disc = late_disc(term)
        if disc is not None:
            by_speed = angles.shape[1] > 2 and not np.isfinite(angles[:, disc]).any()
            column = 2 + disc if by_speed else disc
            delay = float(term.q[0])
            read = angles[:, column]
            angles[:, column] = on_time(read, motion, disc, delay, velocity=by_speed)
            repeats[:, column] = repeats[telling(motion, delay), column]
            continue
        if at_rest(term):
            continue
        torque, error = term.source.response(term.q, rig, motion)
        loads += torque
        angles -= samples.misread(error)
    return replace(samples, loads=loads, angles=angles, repeats=repeats, acting=acting(every))
