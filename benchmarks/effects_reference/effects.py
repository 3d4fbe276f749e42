"""All effects of the reference by name."""

from __future__ import annotations

from .brakes import (
    FrictionHeating,
    FrictionLag,
    FrictionStep,
    LowerLuGre,
    Presliding,
    RateState,
    TorquePulse,
    UpperFrictionLag,
    UpperPresliding,
    Wear,
)
from .drive import (
    ActuatorLag,
    CurrentLimit,
    DriveResonance,
    GearBacklash,
    GearCompliance,
    InputDelay,
    MotorHeating,
    SlewLimit,
)
from .formulas import FORMULAS, Formula
from .strings import (
    LoadDependentFriction,
    LowerResonator,
    LowerViscousDamper,
    StringAsymmetry,
    StringCreep,
    StringHysteresis,
    StringInertia,
    StringPlay,
    UpperResonator,
    UpperViscousDamper,
)
from .view import Effect

EFFECTS: dict[str, type[Effect]] = {
    **dict.fromkeys(FORMULAS, Formula),
    "actuator_lag": ActuatorLag,
    "drive_resonance": DriveResonance,
    "slew_limit": SlewLimit,
    "input_delay": InputDelay,
    "current_limit": CurrentLimit,
    "motor_heating": MotorHeating,
    "gear_compliance": GearCompliance,
    "gear_backlash": GearBacklash,
    "load_dependent_friction": LoadDependentFriction,
    "string_asymmetry": StringAsymmetry,
    "string_play": StringPlay,
    "string_hysteresis": StringHysteresis,
    "string_creep": StringCreep,
    "string_inertia": StringInertia,
    "upper_resonator": UpperResonator,
    "lower_resonator": LowerResonator,
    "upper_viscous_damper": UpperViscousDamper,
    "lower_viscous_damper": LowerViscousDamper,
    "friction_step": FrictionStep,
    "torque_pulse": TorquePulse,
    "friction_heating": FrictionHeating,
    "wear": Wear,
    "presliding": Presliding,
    "lower_lugre": LowerLuGre,
    "upper_presliding": UpperPresliding,
    "upper_friction_lag": UpperFrictionLag,
    "friction_lag": FrictionLag,
    "rate_state": RateState,
}
