"""`drill-env check`: what recordings hold and what is doubtful, without any work on them."""

import json

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from drill_env import InputError, Rig, simulate
from drill_env.cli.main import app
from drill_env.identification.screening import screen
from drill_env.integrator import sampled_voltage
from drill_env.parameters import save_rig
from drill_env.recordings import Recording

MANIFEST = """
[defaults]
columns = { u = "drive", theta_u = "top", theta_l = "bit" }
units = { t = "ms", theta_u = "counts/4096", theta_l = "counts" }
counts_per_rev = 8192

[[recording]]
file = "a.csv"

[[recording]]
file = "b.csv"
role = "holdout"
closed_loop = true
"""


@pytest.fixture
def folder(tmp_path):
    """Two recordings of a rig whose encoders have unlike counts."""
    t = np.arange(4000) / 200.0
    for number, name in enumerate("ab"):
        u = 2.5 + 1.5 * np.sin((0.8 + number) * t)
        run = simulate(Rig(), sampled_voltage(t, u), t[-1], t_eval=t)
        counts = [np.floor(run.theta_u / (2 * np.pi) * 4096)]
        counts.append(np.floor(run.theta_l / (2 * np.pi) * 8192))
        table = {"t": 1e3 * t, "drive": u, "top": counts[0], "bit": counts[1]}
        pd.DataFrame(table).to_csv(tmp_path / f"{name}.csv", index=False)
    (tmp_path / "recordings.toml").write_text(MANIFEST)
    save_rig(Rig(), tmp_path / "rig.toml")
    return tmp_path


def checked(*args):
    result = CliRunner().invoke(app, ["check", *map(str, args)])
    return result.exit_code, result.stdout, result.stderr, result.exception


def test_a_folder_is_told_in_si_units_each_encoder_with_its_own_counts(folder):
    status, out, err, _ = checked(folder, "--rig", folder / "rig.toml", "--json")
    assert status == 0 and "warning" not in err
    fit, held = json.loads(out)
    assert (fit["role"], held["role"], held["closed_loop"]) == ("fit", "holdout", True)
    assert fit["rate_hz"] == pytest.approx(200.0) and fit["gaps"] == 0
    steps = [fit["channels"][name]["step"] for name in ("theta_u", "theta_l")]
    assert steps == pytest.approx([2 * np.pi / 4096, 2 * np.pi / 8192])
    ends = [fit["channels"][name]["high"] for name in ("theta_u", "theta_l")]
    assert ends[0] == pytest.approx(ends[1], abs=5.0)
    assert "holdout, closed loop" in checked(folder)[1]


def test_what_no_rig_can_do_is_an_error(folder):
    table = pd.read_csv(folder / "a.csv")
    save_rig(Rig(km=8.0 * Rig().km), folder / "other.toml")
    error = checked(folder, "--rig", folder / "other.toml")[3]
    assert "times as fast as on the given rig" in str(error)
    table.assign(bit=-table.bit).to_csv(folder / "a.csv", index=False)
    error = checked(folder)[3]
    assert "a.csv" in str(error) and "the sign of theta_l is flipped" in str(error)


@pytest.mark.parametrize("hertz", [0.2, 0.4, 0.7])
def test_a_slow_sine_on_a_flexible_drive_is_sound_and_its_sign_is_told(hertz):
    """The string hardly bends, and the regression gives it and the motor the wrong sign."""
    rig = Rig(
        friction="coulomb", km=0.0166, Ju=1.74e-4, Tsu=4.5e-3, dTsu=0.0, bu=1.6e-3, dbu=0.0,
        Jl=2.5e-4, ktheta=0.187, Tsl=3e-3, bl=2.6e-4,
    )  # fmt: skip
    t, step = np.arange(10000) / 250.0, 2 * np.pi / 4096
    u = 7.0 * np.sin(2 * np.pi * hertz * t)
    run = simulate(rig, sampled_voltage(t, u), t[-1], t_eval=t)
    upper, lower = (np.round(angle / step) * step for angle in (run.theta_u, run.theta_l))
    quanta = {"theta_u": step, "theta_l": step}
    assert screen(Recording(t, u, upper, lower, quanta=quanta), rig) == ()
    with pytest.raises(InputError, match="the sign of u is flipped"):
        screen(Recording(t, -u, upper, lower, quanta=quanta), rig)
