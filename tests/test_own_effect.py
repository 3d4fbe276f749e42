"""An effect from outside the package, registered as the documentation says."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).parents[1] / "docs" / "effects.md"
SNIPPET = PAGE.read_text("utf-8").split("<!-- own-effect -->\n```python\n")[1].split("```")[0]


def run_script(tmp_path, more):
    """In a process of its own: a registered effect would stay for the other tests."""
    script = tmp_path / "own.py"
    script.write_text(f"{SNIPPET}\n{more}", "utf-8")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_documented_effect_is_integrated_right(tmp_path):
    """Against SciPy with the formula written anew; the disc never comes to rest here."""
    from scipy.integrate import solve_ivp

    run_script(
        tmp_path,
        "import numpy as np\n"
        "y = np.array([1.0, 6.0, 6.0, 0.0])\n"
        "run = simulate(rig, 5.0, 2.0, initial=y, rate=50.0)\n"
        f"np.save({str(tmp_path / 'run.npy')!r}, run.state)\n",
    )
    found = np.load(tmp_path / "run.npy")

    def rates(_, y):
        twist, wu, wl, _ = y
        friction = 0.0094 + 0.0826 * np.tanh(3.1799 * wl) - 0.291 * np.tanh(0.0384 * wl)
        x = wl / 5.0
        lower = 0.078 * twist - friction - 0.0042 * wl - 0.02 * 2 * x / (1 + x * x)
        upper = 3.5693 * 5.0 - 0.078 * twist - 0.3212 - 0.0095 - (1.9833 - 0.0167) * wu
        return [wu - wl, upper / 0.4765, lower / 0.0326, wl]

    t = np.arange(len(found)) / 50.0
    truth = solve_ivp(rates, (0, t[-1]), [1.0, 6.0, 6.0, 0.0], "DOP853", t, rtol=1e-10, atol=1e-12)
    assert truth.y[2].min() > 0.5
    np.testing.assert_allclose(found, truth.y.T, atol=2e-4)


def test_it_stands_in_rig_files_environments_and_the_library(tmp_path):
    out = run_script(
        tmp_path,
        "import gymnasium as gym, drill_env\n"
        f"drill_env.save_rig(rig, {str(tmp_path / 'rig.toml')!r})\n"
        f"assert drill_env.load_rig({str(tmp_path / 'rig.toml')!r}) == rig\n"
        "env = gym.make('drill_env:DrillString-v0', rig=rig)\n"
        "env.reset(seed=1)\n"
        "print(env.step(env.action_space.sample())[0].shape)\n"
        "from drill_env.effects.steady import unsteady\n"
        "assert unsteady(rig) == []\n"
        "print('eddy_brake' in effects.LIBRARY)",
    )
    assert out.endswith("True\n")


@pytest.mark.parametrize(
    ("broken", "words"),
    [("'eddy'", "give a drill_env.effects.Effect"), ("replace(e, id='table')", "another id"),
     ("replace(e, component='bit')", "actuator, upper, string, lower, sensor")],
)  # fmt: skip
def test_a_wrong_declaration_is_told(broken, words):
    from dataclasses import replace

    from drill_env import InputError, effects

    before = dict(effects.LIBRARY)
    e = effects.LIBRARY["unbalance"]
    with pytest.raises(InputError, match=words):
        effects.register(eval(broken, {"replace": replace, "e": e}))
    assert dict(effects.LIBRARY) == before
