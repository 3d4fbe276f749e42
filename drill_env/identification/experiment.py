"""Design of experiments: which voltage tells most of what is not yet known of a rig."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification.knowledge import (
    SIGMAS,
    Knowledge,
    bounded,
    residual_shape,
    wider_than,
)
from drill_env.identification.prediction_error import score
from drill_env.identification.samples import prepare
from drill_env.integrator import sampled_voltage, simulate
from drill_env.parameters import SYMBOLS
from drill_env.recordings import Recording
from drill_env.recordings.signals import Signal, signal_samples

D_OPTIMAL = "D"
"""The criterion that shrinks the volume of the whole confidence region most."""

# Share of a parameter's size: an interval as wide as that leaves the region where the rig's
# response is linear in it.
_ROUGH = 0.5

Progress: TypeAlias = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """A signal and what it would tell.

    Attributes:
        signal: the voltage to play.
        deviations: expected standard deviations of the free parameters afterwards, together
            with what is known already, shape (free,).
        gain: expected rise of the logarithm of the information's determinant.
    """

    signal: Signal
    deviations: FloatArray
    gain: float


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """The signals of a menu, the best first.

    Attributes:
        knowledge: where the design started.
        criterion: `D_OPTIMAL` or the name of the parameter that matters.
        deviations: present standard deviations of the free parameters, shape (free,).
        proposals: all signals tried.
    """

    knowledge: Knowledge
    criterion: str
    deviations: FloatArray
    proposals: tuple[Proposal, ...]

    @property
    def best(self) -> Proposal:
        """The signal to play next."""
        return self.proposals[0]

    @property
    def rough(self) -> tuple[str, ...]:
        """Parameters known so little that their expected interval is an order of magnitude."""
        return wider_than(self.knowledge, _ROUGH)

    def shrink(self, proposal: Proposal) -> dict[str, float]:
        """By which share each interval is expected to shrink, 0 to 1."""
        # Of a parameter at its bound the interval is nothing already.
        left = np.divide(
            proposal.deviations, self.deviations,
            out=np.ones_like(self.deviations), where=self.deviations > 0.0,
        )  # fmt: skip
        return dict(zip(self.knowledge.free, (1.0 - left).tolist(), strict=True))

    def mean_shrink(self, proposal: Proposal) -> float:
        """The same for the geometric mean over the axes of the confidence region."""
        return 1.0 - math.exp(-0.5 * proposal.gain / len(self.knowledge.free))

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain data; intervals are half widths at 95 %."""
        free, shrink = self.knowledge.free, self.shrink(self.best)
        return {
            "criterion": self.criterion,
            "signal": self.best.signal.text,
            "residual_shape": residual_shape(self.knowledge),
            "parameters": {
                name: {
                    "value": getattr(self.knowledge.rig, name),
                    "half_width": SIGMAS * before,
                    "expected_half_width": SIGMAS * after,
                    "expected_shrink": shrink[name],
                    "rough": name in self.rough,
                }
                for name, before, after in zip(
                    free, self.deviations.tolist(), self.best.deviations.tolist(), strict=True
                )
            },
            "candidates": [
                {
                    "signal": p.signal.text,
                    "gain": p.gain,
                    "mean_shrink": self.mean_shrink(p),
                    "expected_shrink": self.shrink(p),
                }
                for p in self.proposals
            ],
        }


def expected_information(signal: Signal, knowledge: Knowledge) -> FloatArray:
    """Expected information of a recording that starts at rest, shape (free, free).

    The rig is simulated without its torque noise, which the filter then allows for.

    Args:
        signal: voltage.
        knowledge: rig, noise, encoders and the coordinates of the information.
    """
    rig, slopes = knowledge.rig, knowledge.slopes
    samples = prepare(expected_recording(signal, knowledge), rig)
    found = score(samples, rig, knowledge.noise, samples.starts)
    if not math.isfinite(found.value):
        raise InputError(f"signal {signal.text}: the rig of the estimate cannot be simulated")
    columns = [SYMBOLS.index(name) for name in knowledge.free]
    return slopes.T @ found.information[np.ix_(columns, columns)] @ slopes


def expected_recording(signal: Signal, knowledge: Knowledge) -> Recording:
    """What the encoders would count if the rig were as estimated."""
    t, u = signal_samples(signal)
    run = simulate(knowledge.rig, sampled_voltage(t, u), signal.seconds, t_eval=t)
    angles = {
        name: np.round(getattr(run, name) / step) * step if step > 0 else getattr(run, name)
        for name, step in knowledge.quanta.items()
    }
    steps = {name: step for name, step in knowledge.quanta.items() if step > 0}
    return Recording(t=t, u=u, quanta=steps, source=signal.text, **angles)


def design(
    knowledge: Knowledge,
    signals: Sequence[Signal],
    *,
    criterion: str = D_OPTIMAL,
    progress: Progress | None = None,
) -> Plan:
    """Rank signals by what they would add to what is known.

    The design is local: it holds near the estimate, so plan anew after each recording.

    Args:
        knowledge: from `knowledge_of`, `load_knowledge` or `weak_knowledge`.
        signals: from `menu`.
        criterion: `D_OPTIMAL`, or the name of the one parameter whose interval matters.
        progress: called with (signals done, signals in all).

    Raises:
        InputError: the criterion is no free parameter.
    """
    if criterion != D_OPTIMAL and criterion not in knowledge.free:
        raise InputError(
            f"criterion is {criterion!r}: give {D_OPTIMAL} or a free parameter, "
            f"{', '.join(knowledge.free)}"
        )
    known = bounded(knowledge)
    proposals = []
    for done, (signal, added) in enumerate(_each(knowledge, signals), 1):
        after = replace(known, information=known.information + added)
        gain = _log_determinant(after.information) - _log_determinant(known.information)
        proposals.append(Proposal(signal, after.deviations, gain))
        if progress:
            progress(done, len(signals))
    if criterion == D_OPTIMAL:
        proposals.sort(key=lambda p: -p.gain)
    else:
        place = knowledge.free.index(criterion)
        proposals.sort(key=lambda p: float(p.deviations[place]))
    return Plan(knowledge, criterion, known.deviations, tuple(proposals))


def _each(knowledge: Knowledge, signals: Sequence[Signal]) -> Iterator[tuple[Signal, FloatArray]]:
    pool = ThreadPoolExecutor(os.cpu_count())
    try:
        found = pool.map(lambda signal: expected_information(signal, knowledge), signals)
        yield from zip(signals, found, strict=True)
    finally:
        pool.shutdown(cancel_futures=True)


def _log_determinant(information: FloatArray) -> float:
    # The coordinates differ in size by orders of magnitude.
    scale = np.sqrt(np.diag(information))
    return float(
        np.linalg.slogdet(information / np.outer(scale, scale))[1] + 2 * np.log(scale).sum()
    )
