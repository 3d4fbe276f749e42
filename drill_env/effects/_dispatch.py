"""The one compiled switch over all effects."""

from drill_env._jit import kernel
from drill_env.effects.actuator_lag import actuator_lag
from drill_env.effects.amplifier_deadzone import amplifier_deadzone
from drill_env.effects.amplifier_saturation import amplifier_saturation
from drill_env.effects.brake_runout import brake_runout
from drill_env.effects.current_limit import current_limit
from drill_env.effects.dwell_stiction import dwell_stiction
from drill_env.effects.encoder_delay_lower import encoder_delay_lower
from drill_env.effects.encoder_delay_upper import encoder_delay_upper
from drill_env.effects.encoder_eccentricity_lower import encoder_eccentricity_lower
from drill_env.effects.encoder_eccentricity_upper import encoder_eccentricity_upper
from drill_env.effects.encoder_gain_lower import encoder_gain_lower
from drill_env.effects.friction_drift import friction_drift
from drill_env.effects.friction_heating import friction_heating
from drill_env.effects.friction_lag import friction_lag
from drill_env.effects.friction_step import friction_step
from drill_env.effects.friction_warmup import friction_warmup
from drill_env.effects.gain_asymmetry import gain_asymmetry
from drill_env.effects.gear_backlash import gear_backlash
from drill_env.effects.gear_compliance import gear_compliance
from drill_env.effects.gear_eccentricity import gear_eccentricity
from drill_env.effects.input_delay import input_delay
from drill_env.effects.load_dependent_friction import load_dependent_friction
from drill_env.effects.lower_asymmetry import lower_asymmetry
from drill_env.effects.lower_disturbance import lower_disturbance
from drill_env.effects.lower_stribeck import lower_stribeck
from drill_env.effects.missed_counts_lower import missed_counts_lower
from drill_env.effects.missed_counts_upper import missed_counts_upper
from drill_env.effects.motor_heating import motor_heating
from drill_env.effects.presliding import presliding
from drill_env.effects.quadratic_drag import quadratic_drag
from drill_env.effects.rate_state import rate_state
from drill_env.effects.slew_limit import slew_limit
from drill_env.effects.string_asymmetry import string_asymmetry
from drill_env.effects.string_creep import string_creep
from drill_env.effects.string_damping import string_damping
from drill_env.effects.string_hardening import string_hardening
from drill_env.effects.string_hysteresis import string_hysteresis
from drill_env.effects.string_inertia import string_inertia
from drill_env.effects.string_play import string_play
from drill_env.effects.supply_sag import supply_sag
from drill_env.effects.torque_pulse import torque_pulse
from drill_env.effects.torque_ripple import torque_ripple
from drill_env.effects.unbalance import unbalance
from drill_env.effects.upper_asymmetry import upper_asymmetry
from drill_env.effects.upper_coulomb import upper_coulomb
from drill_env.effects.upper_disturbance import upper_disturbance
from drill_env.effects.upper_friction_lag import upper_friction_lag
from drill_env.effects.upper_offset import upper_offset
from drill_env.effects.upper_presliding import upper_presliding
from drill_env.effects.upper_quadratic_drag import upper_quadratic_drag
from drill_env.effects.upper_stribeck import upper_stribeck
from drill_env.effects.upper_unbalance import upper_unbalance
from drill_env.effects.upper_viscous import upper_viscous
from drill_env.effects.wear import wear
from drill_env.effects.whirl_drag import whirl_drag

ORDER = (
    "amplifier_saturation",
    "amplifier_deadzone",
    "slew_limit",
    "actuator_lag",
    "input_delay",
    "supply_sag",
    "motor_heating",
    "gain_asymmetry",
    "torque_ripple",
    "gear_backlash",
    "gear_compliance",
    "load_dependent_friction",
    "upper_stribeck",
    "upper_quadratic_drag",
    "friction_warmup",
    "gear_eccentricity",
    "upper_disturbance",
    "lower_disturbance",
    "string_damping",
    "string_hardening",
    "string_hysteresis",
    "string_asymmetry",
    "string_play",
    "string_inertia",
    "string_creep",
    "lower_stribeck",
    "lower_asymmetry",
    "presliding",
    "friction_lag",
    "rate_state",
    "dwell_stiction",
    "brake_runout",
    "unbalance",
    "friction_drift",
    "friction_heating",
    "friction_step",
    "wear",
    "quadratic_drag",
    "whirl_drag",
    "torque_pulse",
    "encoder_eccentricity_upper",
    "encoder_delay_upper",
    "missed_counts_upper",
    "encoder_eccentricity_lower",
    "encoder_delay_lower",
    "missed_counts_lower",
    "encoder_gain_lower",
    "upper_coulomb",
    "upper_viscous",
    "upper_offset",
    "upper_asymmetry",
    "upper_friction_lag",
    "upper_presliding",
    "upper_unbalance",
    "current_limit",
)
"""The number of an effect is its place here."""


@kernel
def respond(code, p, q, m, s, out):
    """Add the response of the effect of number `code` to `out`."""
    if code == 0:
        amplifier_saturation(p, q, m, s, out)
    elif code == 1:
        amplifier_deadzone(p, q, m, s, out)
    elif code == 2:
        slew_limit(p, q, m, s, out)
    elif code == 3:
        actuator_lag(p, q, m, s, out)
    elif code == 4:
        input_delay(p, q, m, s, out)
    elif code == 5:
        supply_sag(p, q, m, s, out)
    elif code == 6:
        motor_heating(p, q, m, s, out)
    elif code == 7:
        gain_asymmetry(p, q, m, s, out)
    elif code == 8:
        torque_ripple(p, q, m, s, out)
    elif code == 9:
        gear_backlash(p, q, m, s, out)
    elif code == 10:
        gear_compliance(p, q, m, s, out)
    elif code == 11:
        load_dependent_friction(p, q, m, s, out)
    elif code == 12:
        upper_stribeck(p, q, m, s, out)
    elif code == 13:
        upper_quadratic_drag(p, q, m, s, out)
    elif code == 14:
        friction_warmup(p, q, m, s, out)
    elif code == 15:
        gear_eccentricity(p, q, m, s, out)
    elif code == 16:
        upper_disturbance(p, q, m, s, out)
    elif code == 17:
        lower_disturbance(p, q, m, s, out)
    elif code == 18:
        string_damping(p, q, m, s, out)
    elif code == 19:
        string_hardening(p, q, m, s, out)
    elif code == 20:
        string_hysteresis(p, q, m, s, out)
    elif code == 21:
        string_asymmetry(p, q, m, s, out)
    elif code == 22:
        string_play(p, q, m, s, out)
    elif code == 23:
        string_inertia(p, q, m, s, out)
    elif code == 24:
        string_creep(p, q, m, s, out)
    elif code == 25:
        lower_stribeck(p, q, m, s, out)
    elif code == 26:
        lower_asymmetry(p, q, m, s, out)
    elif code == 27:
        presliding(p, q, m, s, out)
    elif code == 28:
        friction_lag(p, q, m, s, out)
    elif code == 29:
        rate_state(p, q, m, s, out)
    elif code == 30:
        dwell_stiction(p, q, m, s, out)
    elif code == 31:
        brake_runout(p, q, m, s, out)
    elif code == 32:
        unbalance(p, q, m, s, out)
    elif code == 33:
        friction_drift(p, q, m, s, out)
    elif code == 34:
        friction_heating(p, q, m, s, out)
    elif code == 35:
        friction_step(p, q, m, s, out)
    elif code == 36:
        wear(p, q, m, s, out)
    elif code == 37:
        quadratic_drag(p, q, m, s, out)
    elif code == 38:
        whirl_drag(p, q, m, s, out)
    elif code == 39:
        torque_pulse(p, q, m, s, out)
    elif code == 40:
        encoder_eccentricity_upper(p, q, m, s, out)
    elif code == 41:
        encoder_delay_upper(p, q, m, s, out)
    elif code == 42:
        missed_counts_upper(p, q, m, s, out)
    elif code == 43:
        encoder_eccentricity_lower(p, q, m, s, out)
    elif code == 44:
        encoder_delay_lower(p, q, m, s, out)
    elif code == 45:
        missed_counts_lower(p, q, m, s, out)
    elif code == 46:
        encoder_gain_lower(p, q, m, s, out)
    elif code == 47:
        upper_coulomb(p, q, m, s, out)
    elif code == 48:
        upper_viscous(p, q, m, s, out)
    elif code == 49:
        upper_offset(p, q, m, s, out)
    elif code == 50:
        upper_asymmetry(p, q, m, s, out)
    elif code == 51:
        upper_friction_lag(p, q, m, s, out)
    elif code == 52:
        upper_presliding(p, q, m, s, out)
    elif code == 53:
        upper_unbalance(p, q, m, s, out)
    elif code == 54:
        current_limit(p, q, m, s, out)
