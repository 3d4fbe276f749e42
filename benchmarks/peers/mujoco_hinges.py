"""MuJoCo: two hinges and a spring tendon at 1 ms; dry friction by its soft constraint.

Run as a script it answers `peers.common.ask`, so that it may live in an environment of its
own. The smooth rest of the friction laws is applied as a force before every step, as
MuJoCo has no such law; stiction is regularised, so its error does not vanish with the step.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from math import tanh
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from peers.common import (
    BETA1,
    BETA2,
    BL,
    BU,
    DBU,
    DTSU,
    JL,
    JU,
    KM,
    KTHETA,
    T1,
    T2,
    TSL,
    TSU,
    Peer,
    ask,
    serve,
)  # fmt: skip

STEP = 1e-3
MODEL = f"""
<mujoco>
  <option timestep="{STEP}" gravity="0 0 0" integrator="implicitfast"/>
  <worldbody>
    <body><inertial pos="0 0 0" mass="1" diaginertia="{JU} {JU} {JU}"/>
      <joint name="u" type="hinge" axis="0 0 1" damping="{BU}" frictionloss="{TSU}"/></body>
    <body><inertial pos="0 0 0" mass="1" diaginertia="{JL} {JL} {JL}"/>
      <joint name="l" type="hinge" axis="0 0 1" damping="{BL}" frictionloss="{TSL}"/></body>
  </worldbody>
  <tendon><fixed name="string" stiffness="{KTHETA}" springlength="0">
    <joint joint="u" coef="1"/><joint joint="l" coef="-1"/></fixed></tendon>
</mujoco>
"""


def run(volts: float, times: list[float]) -> tuple[float, list[float]]:
    """Wall seconds and omega_l at the samples (multiples of the step)."""
    import mujoco  # pyright: ignore[reportMissingImports]

    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    speed, force, step = data.qvel, data.qfrc_applied, mujoco.mj_step
    due = {round(t / STEP) for t in times}
    out = [0.0] if 0 in due else []
    start = time.perf_counter()
    for i in range(1, max(due) + 1):
        wu, wl = speed.tolist()
        force[0] = KM * volts - DTSU - DBU * abs(wu)
        force[1] = -T1 * tanh(0.5 * BETA1 * wl) - T2 * tanh(0.5 * BETA2 * wl)
        step(model, data)
        if i in due:
            out.append(float(speed[1]))
    return time.perf_counter() - start, out


def peer(python: Sequence[str]) -> Peer:
    def measure(volts: float, times: Sequence[float]) -> tuple[float, list[float]]:
        return ask(python, "mujoco_hinges.py", volts, times)

    return Peer("MuJoCo hinges with frictionloss, 1 ms", measure)


if __name__ == "__main__":
    serve(run)
