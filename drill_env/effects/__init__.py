"""Physics beyond the paper's rig: one declared effect a file, compiled once for all callers."""

from types import MappingProxyType

from drill_env.effects._dispatch import ORDER
from drill_env.effects._effect import Effect, EffectParameter
from drill_env.effects.actuator_lag import EFFECT as _actuator_lag
from drill_env.effects.amplifier_deadzone import EFFECT as _amplifier_deadzone
from drill_env.effects.amplifier_saturation import EFFECT as _amplifier_saturation
from drill_env.effects.brake_runout import EFFECT as _brake_runout
from drill_env.effects.current_limit import EFFECT as _current_limit
from drill_env.effects.dwell_stiction import EFFECT as _dwell_stiction
from drill_env.effects.encoder_delay_lower import EFFECT as _encoder_delay_lower
from drill_env.effects.encoder_delay_upper import EFFECT as _encoder_delay_upper
from drill_env.effects.encoder_eccentricity_lower import EFFECT as _encoder_eccentricity_lower
from drill_env.effects.encoder_eccentricity_upper import EFFECT as _encoder_eccentricity_upper
from drill_env.effects.encoder_gain_lower import EFFECT as _encoder_gain_lower
from drill_env.effects.friction_drift import EFFECT as _friction_drift
from drill_env.effects.friction_heating import EFFECT as _friction_heating
from drill_env.effects.friction_lag import EFFECT as _friction_lag
from drill_env.effects.friction_step import EFFECT as _friction_step
from drill_env.effects.friction_warmup import EFFECT as _friction_warmup
from drill_env.effects.gain_asymmetry import EFFECT as _gain_asymmetry
from drill_env.effects.gear_backlash import EFFECT as _gear_backlash
from drill_env.effects.gear_compliance import EFFECT as _gear_compliance
from drill_env.effects.gear_eccentricity import EFFECT as _gear_eccentricity
from drill_env.effects.input_delay import EFFECT as _input_delay
from drill_env.effects.load_dependent_friction import EFFECT as _load_dependent_friction
from drill_env.effects.lower_asymmetry import EFFECT as _lower_asymmetry
from drill_env.effects.lower_disturbance import EFFECT as _lower_disturbance
from drill_env.effects.lower_stribeck import EFFECT as _lower_stribeck
from drill_env.effects.missed_counts_lower import EFFECT as _missed_counts_lower
from drill_env.effects.missed_counts_upper import EFFECT as _missed_counts_upper
from drill_env.effects.motor_heating import EFFECT as _motor_heating
from drill_env.effects.presliding import EFFECT as _presliding
from drill_env.effects.quadratic_drag import EFFECT as _quadratic_drag
from drill_env.effects.rate_state import EFFECT as _rate_state
from drill_env.effects.slew_limit import EFFECT as _slew_limit
from drill_env.effects.string_asymmetry import EFFECT as _string_asymmetry
from drill_env.effects.string_creep import EFFECT as _string_creep
from drill_env.effects.string_damping import EFFECT as _string_damping
from drill_env.effects.string_hardening import EFFECT as _string_hardening
from drill_env.effects.string_hysteresis import EFFECT as _string_hysteresis
from drill_env.effects.string_inertia import EFFECT as _string_inertia
from drill_env.effects.string_play import EFFECT as _string_play
from drill_env.effects.supply_sag import EFFECT as _supply_sag
from drill_env.effects.torque_pulse import EFFECT as _torque_pulse
from drill_env.effects.torque_ripple import EFFECT as _torque_ripple
from drill_env.effects.unbalance import EFFECT as _unbalance
from drill_env.effects.upper_asymmetry import EFFECT as _upper_asymmetry
from drill_env.effects.upper_coulomb import EFFECT as _upper_coulomb
from drill_env.effects.upper_disturbance import EFFECT as _upper_disturbance
from drill_env.effects.upper_friction_lag import EFFECT as _upper_friction_lag
from drill_env.effects.upper_offset import EFFECT as _upper_offset
from drill_env.effects.upper_presliding import EFFECT as _upper_presliding
from drill_env.effects.upper_quadratic_drag import EFFECT as _upper_quadratic_drag
from drill_env.effects.upper_stribeck import EFFECT as _upper_stribeck
from drill_env.effects.upper_unbalance import EFFECT as _upper_unbalance
from drill_env.effects.upper_viscous import EFFECT as _upper_viscous
from drill_env.effects.wear import EFFECT as _wear
from drill_env.effects.whirl_drag import EFFECT as _whirl_drag

_ALL = (
    _amplifier_saturation,
    _amplifier_deadzone,
    _slew_limit,
    _actuator_lag,
    _input_delay,
    _supply_sag,
    _motor_heating,
    _gain_asymmetry,
    _torque_ripple,
    _gear_backlash,
    _gear_compliance,
    _load_dependent_friction,
    _upper_stribeck,
    _upper_quadratic_drag,
    _friction_warmup,
    _gear_eccentricity,
    _upper_disturbance,
    _lower_disturbance,
    _string_damping,
    _string_hardening,
    _string_hysteresis,
    _string_asymmetry,
    _string_play,
    _string_inertia,
    _string_creep,
    _lower_stribeck,
    _lower_asymmetry,
    _presliding,
    _friction_lag,
    _rate_state,
    _dwell_stiction,
    _brake_runout,
    _unbalance,
    _friction_drift,
    _friction_heating,
    _friction_step,
    _wear,
    _quadratic_drag,
    _whirl_drag,
    _torque_pulse,
    _encoder_eccentricity_upper,
    _encoder_delay_upper,
    _missed_counts_upper,
    _encoder_eccentricity_lower,
    _encoder_delay_lower,
    _missed_counts_lower,
    _encoder_gain_lower,
    _upper_coulomb,
    _upper_viscous,
    _upper_offset,
    _upper_asymmetry,
    _upper_friction_lag,
    _upper_presliding,
    _upper_unbalance,
    _current_limit,
)

LIBRARY = MappingProxyType({effect.id: effect for effect in _ALL})
"""Every effect by its id."""

__all__ = ["LIBRARY", "ORDER", "Effect", "EffectParameter"]
