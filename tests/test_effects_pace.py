"""How fast an effect's inner states change, which sets the steps that they are carried on by."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env.effects import LIBRARY
from drill_env.effects.declared import bundled
from drill_env.effects.pace import slopes_when
from drill_env.effects.signal import MOST_STATES, PORTS, SIGNAL
from drill_env.friction import kernel_record
from drill_env.parameters import Rig


@pytest.mark.parametrize("ahead", [2.0, 3.0, 5.0])
def test_a_motor_that_is_just_let_go_is_as_fast_as_its_spring_and_losses(ahead: float):
    """Not as the jump of its friction where it would turn the other way."""
    rig, frequency, share, damping, at_motor = Rig.paper(), 5.0, 0.25, 0.07, 0.1
    numbers = np.array([frequency, share, at_motor, damping])
    entry = bundled([(LIBRARY["gear_compliance"], numbers)]).entries[0]
    signal, ports = np.zeros(1, dtype=SIGNAL)[0], np.zeros(1, dtype=PORTS)[0]
    slopes = np.zeros((5, MOST_STATES))
    # The disc turns back, the motor stands, the spring between them is wound up.
    slopes_when(kernel_record(rig)[0], entry.copy(), signal, ports, -ahead, ahead, slopes)
    # J_m dw/dt = -k z - c (w - w_u) - friction, with k and c as the documentation has them.
    ringing = 2.0 * np.pi * frequency
    spring, loss = (1.0 - share) * ringing**2, 2.0 * damping * (1.0 - share) * ringing
    friction = at_motor * (rig.bu - rig.dbu) / (share * rig.Ju)
    assert slopes[:2, :2] == pytest.approx(
        np.array([[0.0, 1.0], [-spring, -loss - friction]]), rel=1e-4, abs=1e-4
    )
