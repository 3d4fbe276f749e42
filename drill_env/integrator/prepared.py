"""A rig laid out for the compiled integrator: its record, its effects and its working arrays."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray, IntArray
from drill_env.effects.declared import Declared, declared
from drill_env.effects.signal import RESTING
from drill_env.friction import kernel_record
from drill_env.integrator._effect_slopes import first_slopes
from drill_env.integrator.modes import start_any, start_mode, start_with_effects
from drill_env.integrator.slopes import Slopes
from drill_env.integrator.tableau import tableau
from drill_env.integrator.voltage import Voltage, with_past
from drill_env.parameters import Rig


class Prepared:
    """A rig's record and effects for one kind of run.

    Args:
        rig: parameters and effects.
        method: pair, see `tableau`.
        sensitivity: whether sensitivities are wanted.

    Raises:
        InputError: an effect of the rig is wrong.
    """

    def __init__(self, rig: Rig, method: str, sensitivity: bool = False) -> None:
        self.rig, self.p = rig, kernel_record(rig)
        self.effects: Declared = declared(rig)
        self.pair = tableau(method, sensitivity, self.effects.acts)
        wanted = sensitivity and self.effects.acts
        self.slopes = Slopes(rig, self.effects, self.p[0]) if wanted else None

    def equip(self, work: np.ndarray) -> None:
        """Tell the working arrays of the effects."""
        equip(work, self.effects)
        if self.slopes is not None:
            self.slopes.equip(work)

    def drive(
        self, voltage: Voltage, work: np.ndarray, initial: FloatArray,
        earlier: Voltage | None = None,
    ) -> Voltage:  # fmt: skip
        """The voltage as the pieces of the run, with its past where an effect reads that."""
        delay = self.effects.delay
        work["late"] = 0
        if not self.effects.reads_past:
            return voltage
        source = voltage if earlier is None else earlier
        before = 0.0 if abs(initial[1]) < RESTING else float(source(source.breaks[0]))
        found, work["late"] = with_past(voltage, delay, before, source)
        return found

    def start(
        self, run: np.ndarray, work: np.ndarray, u: float,
        modes: IntArray | None = None, inner: FloatArray | None = None,
    ) -> None:  # fmt: skip
        """Modes, branches and inner states of the state in `run`; given ones are kept."""
        if modes is not None:
            run["mode"] = modes
        if not self.effects.acts:
            if modes is None:
                start_mode(self.p[0], run[0], u)
            return
        if inner is not None:
            run["z"][0, : self.effects.inner] = inner
        work["start"], work["end"] = run["t"], run["t"] + 1.0
        work["coefficients"], work["piece"][0, 0] = 1, u
        work["past"] = 0.0
        work["past"][0, 0] = 0.0 if abs(run["y"][0, 1]) < RESTING else u
        wanted = (modes is None) + 2 * (inner is None)
        given = self.p[0], run[0], work[0], self.pair[0]
        start_any(*given, start_with_effects.address, wanted, u)
        if self.slopes is not None:
            start_any(*given, first_slopes.address, int(inner is None), u)


def equip(work: np.ndarray, effects: Declared) -> None:
    """Tell new working arrays of effects; the entries must live as long as they are used."""
    if not len(effects.entries):
        return
    acting = effects.acts
    work["effects"] = effects.entries.ctypes.data
    work["acting"] = len(effects.entries) if acting else 0
    work["restless"] = effects.restless
    work["sided"] = effects.entries["sided"].any()
    work["own_law"] = effects.wants_own_law
    work["inner"] = effects.inner if acting else 0
    work["switches"] = effects.switches if acting else 0
    work["max_step"] = np.minimum(work["max_step"], effects.longest_step)
