"""Classical controllers, one a file, all behind `drill_env.controllers.Controller`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from drill_env._errors import InputError
from drill_env.controllers import Controller
from drill_env.environment.config import EnvConfig

from .active_damping import ActiveDamping
from .adaptive_ekf import AdaptiveEKF, ToldDelayEKF, Unknown
from .gains import Tunable, tuned_gains
from .h_infinity import HInfinity
from .lqg import LQG
from .lqi import LQI, LQR
from .mpc import MPC
from .open_loop import OpenLoop
from .pi import SpeedPI
from .set_valued_observer import SetValuedObserver
from .sliding_mode import SlidingMode
from .soft_speed import SoftSpeed
from .twist_feedback import TwistFeedback
from .z_torque import ZTorque

TUNABLE: dict[str, Tunable] = {
    "twist-feedback": Tunable(TwistFeedback, {"impedance": (0.5, 8.0), "corner": (0.05, 1.0)}),
    "lqr": Tunable(
        LQR, {"effort": (0.05, 50.0), "slip": (0.05, 20.0), "lower": (0.01, 1.0)}
    ),
    "lqi": Tunable(
        LQI,
        {
            "slip": (0.05, 20.0), "lower": (0.01, 1.0), "integral": (0.001, 1.0),
            "relax": (0.1, 10.0),
        },
    ),
    "sliding-mode": Tunable(
        SlidingMode, {"impedance": (0.5, 8.0), "reach": (1.0, 10.0), "grip": (0.3, 10.0)}
    ),
    "set-valued-observer": Tunable(
        SetValuedObserver, {"effort": (0.01, 100.0), "lower": (0.005, 1.0)}
    ),
    "h-infinity": Tunable(
        HInfinity,
        {
            "bandwidth": (0.05, 3.0), "effort": (0.05, 10.0), "push": (0.1, 10.0),
            "noise": (0.03, 3.0),
        },
    ),
    "soft-speed": Tunable(SoftSpeed, {"impedance": (3.0, 15.0), "inertia": (0.85, 1.2)}),
    "z-torque": Tunable(
        ZTorque, {"impedance": (0.5, 10.0), "corner": (0.03, 0.5), "smoothing": (0.02, 1.0)}
    ),
    "lqg": Tunable(
        LQG,
        {
            "effort": (0.05, 50.0), "slip": (0.05, 20.0), "upper": (1e-4, 0.1),
            "lower": (1e-3, 1.0), "integral": (1e-4, 1.0), "relax": (0.1, 10.0),
        },
    ),
    "adaptive-ekf": Tunable(
        AdaptiveEKF,
        {
            "effort": (0.2, 30.0), "slip": (0.2, 5.0), "upper": (3e-4, 0.02),
            "lower": (0.005, 0.2), "walk": (1e-6, 1e-3), "viscous_walk": (1e-7, 1e-3),
            "friction_walk": (1e-6, 1e-2), "offset_walk": (1e-4, 1e-2),
            "delay_walk": (1e-8, 1e-4), "blur": (0.002, 0.1), "doubt": (0.1, 2.0),
            "spread": (0.1, 1.5), "delay": (0.01, 0.12), "alarm": (1.5, 10.0),
            "refill": (0.01, 1.0), "refill_plant": (0.05, 5.0), "refill_state": (0.01, 1.0),
            "headroom": (0.01, 0.4),
        },
    ),
}  # fmt: skip
"""Controllers whose gains come from `drill_env.benchmark.tuning`, with what it may choose."""


_THREE: tuple[Unknown, ...] = ("viscous", "offset", "friction")


def _tuned(name: str, build: Callable[..., Controller] | None = None) -> Callable[..., Controller]:
    """The controller with the gains that were found for `name`."""
    return partial(build or TUNABLE[name].build, **tuned_gains(name))


CONTROLLERS: dict[str, Callable[[EnvConfig], Controller]] = {
    "open-loop": OpenLoop,
    "pi": SpeedPI,
    "active-damping": ActiveDamping,
    "active-damping-z0": partial(ActiveDamping, impedance=1.0),
    "active-damping-4z0": partial(ActiveDamping, impedance=4.0),
    "twist-feedback": _tuned("twist-feedback"),
    "lqr": _tuned("lqr"),
    "lqi": _tuned("lqi"),
    "sliding-mode": _tuned("sliding-mode"),
    "set-valued-observer": _tuned("set-valued-observer"),
    "h-infinity": _tuned("h-infinity"),
    "mpc": _tuned("lqi", MPC),
    "soft-speed": _tuned("soft-speed"),
    "z-torque": _tuned("z-torque"),
    "lqg": _tuned("lqg"),
    "adaptive-ekf": _tuned("adaptive-ekf"),
    "adaptive-ekf-3": _tuned("adaptive-ekf", partial(AdaptiveEKF, unknown=(*_THREE, "delay"))),
    "adaptive-ekf-told": _tuned("adaptive-ekf", partial(ToldDelayEKF, unknown=_THREE)),
}
"""Makers by the name the command line uses."""


def make(name: str, config: EnvConfig) -> Controller:
    """The controller `name`, designed for the nominal rig of `config`.

    Raises:
        InputError: the name is unknown.
    """
    if name not in CONTROLLERS:
        raise InputError(f"controller {name!r} is unknown; known: {', '.join(CONTROLLERS)}")
    return CONTROLLERS[name](config)


__all__ = [
    "CONTROLLERS",
    "LQG",
    "LQI",
    "LQR",
    "MPC",
    "TUNABLE",
    "ActiveDamping",
    "AdaptiveEKF",
    "HInfinity",
    "OpenLoop",
    "SetValuedObserver",
    "SlidingMode",
    "SoftSpeed",
    "SpeedPI",
    "ToldDelayEKF",
    "TwistFeedback",
    "ZTorque",
    "make",
]
