"""Vector environment and stable-baselines3 adapter against the scalar environment."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import drill_env  # noqa: F401
from drill_env import InputError
from drill_env.sensors import Encoder

N = 5
OPTIONS = {
    "uncertainty": "L2",
    "start": "random",
    "episode_seconds": 3.0,
    "history": 2,
    "friction_step": ((0.5, 2.0), (0.7, 1.5)),
    "encoder": Encoder(noise_rad=1e-3, missed_per_count=1e-3),
}


def actions(steps: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(-5, 5, (steps, N, 1)).astype(np.float32)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize("name", ["DrillString-v0", "DrillStringSurface-v0"])
def test_bit_identical_to_scalar_environments(name: str, mode: AutoresetMode) -> None:
    """Gymnasium's own vectorisation of the scalar env is the reference."""
    ours = gym.make_vec(name, num_envs=N, autoreset_mode=mode, **OPTIONS)
    assert ours.metadata["autoreset_mode"] is mode
    makers = [lambda: gym.make(name, **OPTIONS)] * N
    theirs = SyncVectorEnv(makers, autoreset_mode=mode)
    np.testing.assert_array_equal(ours.reset(seed=7)[0], theirs.reset(seed=7)[0])
    for action in actions(150):
        a, b = ours.step(action), theirs.step(action)
        for k in range(4):
            np.testing.assert_array_equal(a[k], b[k])
        for key in ("omega_l", "twist", "stuck_l", "reward_track"):
            np.testing.assert_array_equal(a[4][key][a[4][f"_{key}"]], b[4][key])
        if "final_obs" in b[4]:
            np.testing.assert_array_equal(np.stack(a[4]["final_obs"]), np.stack(b[4]["final_obs"]))


def test_adapter_is_bit_identical_to_sb3_dummy_vec_env() -> None:
    from stable_baselines3.common.vec_env import DummyVecEnv

    from drill_env.environment.sb3 import DrillStringVecEnv

    ours = DrillStringVecEnv(N, **OPTIONS)
    theirs = DummyVecEnv([lambda: gym.make("DrillString-v0", **OPTIONS)] * N)
    for env in (ours, theirs):
        env.seed(11)
    np.testing.assert_array_equal(ours.reset(), theirs.reset())
    ended = 0
    for action in actions(150):
        a, b = ours.step(action), theirs.step(action)
        for k in range(3):
            np.testing.assert_array_equal(a[k], b[k])
        for mine, other in zip(a[3], b[3], strict=True):
            if "terminal_observation" in other:
                ended += 1
                np.testing.assert_array_equal(
                    mine["terminal_observation"], other["terminal_observation"]
                )
                assert mine["TimeLimit.truncated"] and other["TimeLimit.truncated"]
                assert mine["episode"]["l"] == 60
    assert ended == 2 * N


def test_disabled_autoreset_resets_by_mask() -> None:
    env = gym.make_vec("DrillString-v0", num_envs=2, autoreset_mode="Disabled", episode_seconds=0.1)
    env.reset(seed=0)
    zero = np.zeros((2, 1), dtype=np.float32)
    env.step(zero)
    assert env.step(zero)[3].all()
    with pytest.raises(InputError, match="reset_mask"):
        env.step(zero)
    env.reset(options={"reset_mask": np.array([True, True])})
    assert not env.step(zero)[3].any()


def test_works_in_sb3_without_importing_drill_env_first() -> None:
    """The prefixed id is what a fresh subprocess worker can resolve."""
    import subprocess
    import sys

    code = (
        "import gymnasium as gym; e = gym.make('drill_env:DrillString-v0'); e.reset(seed=0);"
        "v = gym.make_vec('drill_env:DrillString-v0', num_envs=3); v.reset(seed=0);"
        "print(type(e.unwrapped).__name__, type(v).__name__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["DrillStringEnv", "DrillStringVectorEnv"]


def test_bad_arguments() -> None:
    with pytest.raises(InputError, match="num_envs"):
        gym.make_vec("DrillString-v0", num_envs=0)
    env = gym.make_vec("DrillString-v0", num_envs=3)
    with pytest.raises(InputError, match="reset"):
        env.step(np.zeros((3, 1), dtype=np.float32))
    env.reset(seed=0)
    with pytest.raises(InputError, match="give 3"):
        env.step(np.zeros((2, 1), dtype=np.float32))
    with pytest.raises(InputError, match="NaN"):
        env.step(np.full((3, 1), np.nan, dtype=np.float32))
