"""A shape that multiplies a torque tells gears of no library from bad encoders."""

from __future__ import annotations

import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import Rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.report.diagnosis_page import diagnosis_page
from tests.made_recordings import made

ECCENTRIC = Hidden("gear_eccentricity", {"eccentricity": 0.02, "phase": 1.0})
TOOTH = Hidden("gear_bad_tooth", {"excess": 0.5, "angle": 2.0})
KEPT = {"encoder_eccentricity_upper", "torque_ripple", "quadratic_drag"}


@pytest.mark.parametrize(
    ("hidden", "kept"), [(ECCENTRIC, KEPT), (TOOTH, {*KEPT, "gear_eccentricity"})]
)
def test_a_gear_out_of_the_library_is_no_neighbour_of_it(hidden: Hidden, kept: set[str]):
    """Before, one was taken for an eccentric encoder, the other for an eccentric gear."""
    recordings = [made(Rig(), (hidden,), (9, i), volts=4.0) for i in range(3)]
    options = DiagnosisOptions(leave_out=tuple(sorted(set(LIBRARY) - kept)), most=1)
    found = diagnose(recordings[:2], Rig(), [recordings[2]], options=options)
    result = found.result
    assert result.verdict == "unexplained" and result.shape is not None
    assert result.located is not None
    assert (result.located.component, result.located.depends_on) == ("upper", "theta_u")
    # A bad tooth adds to the friction, of which most is viscous.
    sort = "drive" if hidden is ECCENTRIC else "damping"
    assert result.shape.sort == found.rig.effects[0]["sort"] == sort
    if hidden is ECCENTRIC:
        assert max(result.shape.values) == pytest.approx(0.02, rel=0.2)
    turned = "along the voltage" if hidden is ECCENTRIC else "against the motion"
    assert f"torque {turned}" in diagnosis_page(found)
    for errors in result.fit["five_second_prediction"].values():
        assert errors["after_rms"] < 0.8 * errors["before_rms"]
