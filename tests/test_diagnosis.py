"""The detective on recordings of a plant that shares no code with the package."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import InputError, Rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from tests.made_recordings import made

RIG = Rig().replace(km=3.66, bu=2.03, ktheta=0.0765, Tsl=0.0096, beta1=6.5)

# 8e-4 rad/Nm between 0.4 and 0.6 of Ju.
GEAR_HZ = math.sqrt(1.0 / 8e-4 / (0.24 * RIG.Ju)) / (2.0 * math.pi)


def recordings(hidden, seed, count=3, volts=5.0):
    return [made(RIG, tuple(hidden), (seed, i), volts=volts) for i in range(count)]


def test_nothing_is_missing_from_a_rig_with_other_parameters():
    *fit, held = recordings([], 1)
    found = diagnose(fit, Rig(), [held]).result
    assert found.verdict == "consistent" and found.effects == [] and found.shape is None
    change = found.parameters_changed["km"]
    # Ju is given and the same in both.
    assert change.low < RIG.km < change.high and not change.low < change.before < change.high
    given = diagnose(fit, Rig(), [held], options=DiagnosisOptions(given_rig=True)).result
    assert given.verdict == "parameters"


@pytest.fixture(scope="module")
def unbalanced():
    return recordings([Hidden("unbalance", {"torque": 0.01, "phase": 0.7})], 2)


def test_a_concealed_unbalance_is_named_located_and_modelled(unbalanced):
    *fit, held = unbalanced
    # The scale of torque is known: no doubt about it in the intervals.
    known = DiagnosisOptions(fixed={"Ju": RIG.Ju})
    found = diagnose(fit, Rig(), [held], options=known)
    result = found.result
    assert result.verdict == "missing_physics"
    assert result.complete and not any("ended early" in line for line in result.sentences)
    assert [effect.id for effect in result.effects] == ["unbalance"]
    assert result.located is not None
    assert (result.located.component, result.located.depends_on) == ("lower", "theta_l")
    assert result.located.angle_order == 1
    torque = result.effects[0].parameters["torque"]
    assert torque.low < 0.01 < torque.high and torque.high - torque.low < 1e-3
    errors = result.fit["five_second_prediction"]["theta_l"]
    assert errors["after_rms"] < 2.0 * errors["floor_rms"] < 0.5 * errors["before_rms"]
    assert found.rig.effects[0]["id"] == "unbalance"


def test_without_its_name_the_shape_is_shown(unbalanced):
    *fit, held = unbalanced
    options = DiagnosisOptions(leave_out=("unbalance", "brake_runout"))
    result = diagnose(fit, Rig(), [held], options=options).result
    assert result.verdict == "unexplained"
    assert result.located is not None and result.located.depends_on == "theta_l"
    assert result.shape is not None and result.shape.coordinate == "theta_l"
    values = np.array(result.shape.values)
    first = abs(np.fft.rfft(values)[1]) * 2 / len(values)
    assert first == pytest.approx(0.01, rel=0.1)


def test_the_same_recordings_give_the_same_answer(unbalanced):
    short = [r.part(0, 2000) for r in unbalanced[:1]]
    options = DiagnosisOptions(leave_out=tuple(n for n in LIBRARY if n != "unbalance"), most=1)
    once, again = (diagnose(short, Rig(), options=options).result.as_dict() for _ in range(2))
    assert once == again


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (dict(recordings=[]), "at least one recording"),
    ],
)
def test_bad_arguments_are_named(unbalanced, arguments, named):
    call = {"recordings": unbalanced[:1], "rig": Rig(), **arguments}
    with pytest.raises(InputError, match=named):
        diagnose(call["recordings"], call["rig"])


@pytest.mark.parametrize(
    "name, told, parameter, truth, within",
    [
        # Both bend the rig's own parameters far before they are named.
        ("encoder_delay_lower", {"delay": 0.03}, "delay", 0.03, 2e-3),
        ("actuator_lag", {"tau": 0.05}, "time_constant", 0.05, 1e-3),
        # At 20 Hz: only the voltage's steps show it.
        ("gear_compliance", {"compliance": 8e-4, "motor_share": 0.4}, "frequency", GEAR_HZ, 0.2),
    ],
)
def test_what_has_no_amplitude_is_named_too(name, told, parameter, truth, within):
    made = recordings([Hidden(name, told)], 5)
    result = diagnose(made[:3], Rig(), made[3:]).result
    assert [effect.id for effect in result.effects] == [name]
    number = result.effects[0].parameters[parameter]
    assert number.value == pytest.approx(truth, abs=within)


def test_a_limit_just_below_the_highest_voltage_is_named():
    """It clips little; any limit that is not near it clips far too much or nothing."""
    *fit, held = recordings([Hidden("amplifier_saturation", {"limit": 3.38})], 6, volts=3.5)
    result = diagnose(fit, Rig(), [held]).result
    assert [effect.id for effect in result.effects] == ["amplifier_saturation"]
    assert result.effects[0].parameters["level"].value == pytest.approx(3.38, abs=0.01)


def test_a_name_stands_before_a_shape_that_held_out_recordings_do_not_prefer():
    *fit, held = recordings([Hidden("upper_quadratic_drag", {"coefficient": 0.01})], 5)
    result = diagnose(fit, Rig(), [held]).result
    assert result.verdict == "missing_physics"
    assert [effect.id for effect in result.effects] == ["upper_quadratic_drag"]
    # Within the doubt about the scale of torque.
    number = result.effects[0].parameters["coefficient"]
    assert number.low < 0.01 < number.high


@pytest.mark.parametrize("options", [dict(leave_out=("gremlins",)), dict(most=-1)])
def test_bad_options_are_named(options):
    with pytest.raises(InputError, match=next(iter(options)).split("_")[0]):
        DiagnosisOptions(**options)
