"""Environments whose rig has effects."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import drill_env  # noqa: F401
from drill_env import InputError, Rig
from drill_env.environment import DrillStringEnv
from drill_env.environment.config import EnvConfig
from drill_env.environment.core import EnvCore
from drill_env.friction import lower_curve
from drill_env.integrator import sampled_voltage, simulate
from drill_env.parameters import save_rig
from drill_env.sensors import Encoder

N = 4
EFFECTS = (
    {"id": "unbalance", "torque": 0.03, "phase": 1.0},
    {"id": "lower_stribeck", "torque": 0.01, "velocity": 0.3},
    {"id": "actuator_lag", "time_constant": 0.08},
    {"id": "friction_heating", "loss": 0.3, "time_constant": 5.0},
    {"id": "encoder_eccentricity_lower", "error": 0.05, "phase": 0.3},
    {"id": "missed_counts_upper", "share": 0.01, "speed": 0.5},
)
RIG = Rig(effects=EFFECTS)
OPTIONS = {
    "rig": RIG,
    "uncertainty": "L2",
    "start": "random",
    "episode_seconds": 2.0,
    "history": 2,
    "friction_step": ((0.5, 1.5), (0.7, 1.5)),
    "encoder": Encoder(noise_rad=1e-3, missed_per_count=1e-3),
}


def actions(steps: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(-5, 5, (steps, N, 1)).astype(np.float32)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_vector_is_bit_identical_to_scalar(mode):
    ours = gym.make_vec("DrillString-v0", num_envs=N, autoreset_mode=mode, **OPTIONS)
    theirs = SyncVectorEnv([lambda: gym.make("DrillString-v0", **OPTIONS)] * N, autoreset_mode=mode)
    np.testing.assert_array_equal(ours.reset(seed=7)[0], theirs.reset(seed=7)[0])
    for action in actions(90):
        a, b = ours.step(action), theirs.step(action)
        for k in range(4):
            np.testing.assert_array_equal(a[k], b[k])
        np.testing.assert_array_equal(a[4]["twist"][a[4]["_twist"]], b[4]["twist"])


def test_adapter_is_bit_identical_to_sb3_dummy_vec_env():
    from stable_baselines3.common.vec_env import DummyVecEnv

    from drill_env.environment.sb3 import DrillStringVecEnv

    ours = DrillStringVecEnv(N, **OPTIONS)
    theirs = DummyVecEnv([lambda: gym.make("DrillString-v0", **OPTIONS)] * N)
    for env in (ours, theirs):
        env.seed(11)
    np.testing.assert_array_equal(ours.reset(), theirs.reset())
    for action in actions(60):
        a, b = ours.step(action), theirs.step(action)
        for k in range(3):
            np.testing.assert_array_equal(a[k], b[k])


def test_environment_moves_as_the_simulation(tmp_path: Path):
    """The rig file is read, the motion that of `simulate`, the encoders read what they should."""
    save_rig(RIG, tmp_path / "rig.toml")
    encoder = Encoder(counts_per_rev=0)
    env = gym.make("DrillString-v0", rig=tmp_path / "rig.toml", encoder=encoder).unwrapped
    assert isinstance(env, DrillStringEnv)
    env.reset(seed=0)
    volts = 2.5 + 2.0 * np.sin(0.3 * np.arange(120))
    seen, states, torques = [], [], []
    for volt in volts:
        observation, *_, info = env.step(np.array([volt]))
        seen.append(observation[0])
        states.append(env.state)
        torques.append(info["friction_torque_l"])
    t = 0.05 * np.arange(121)
    samples = np.arange(601) * 0.01
    truth = simulate(RIG, sampled_voltage(t, volts), 6.0, t_eval=samples)
    np.testing.assert_allclose(states, truth.state[5::5], atol=1e-4)
    twist = truth.readings[5::5, 0] - truth.readings[5::5, 1]
    np.testing.assert_allclose(seen, twist, atol=1e-4)
    assert np.abs(twist - truth.twist[5::5]).max() > 0.04
    # The info tells the brake's own torque, without what the effects add.
    slips = truth.omega_l[5::5] > 0.5
    law = lower_curve(RIG, truth.omega_l[5::5])
    np.testing.assert_allclose(np.array(torques)[slips], law[slips], atol=1e-4)


SHAKEN = (
    {"id": "unbalance", "torque": 0.02, "phase": 1.0},
    {"id": "string_damping", "damping": 5e-3},
    {"id": "lower_disturbance", "torque": 0.004, "phase": 0.4, "frequency": 1.3},
    {"id": "upper_disturbance", "torque": 0.1, "phase": 2.0, "frequency": 0.9},
)


@pytest.mark.parametrize("method", ["dopri5", "dop853"])
@pytest.mark.parametrize("effects", [(), SHAKEN])
def test_the_torques_told_are_those_of_the_state_at_the_periods_end(effects, method):
    """A disc that slides feels its law; one at rest what the balance of its equation asks for."""
    rig = Rig(effects=effects, dTsu=0.05, dbu=0.1)
    env = gym.make("DrillString-v0", rig=rig, method=method).unwrapped
    env.reset(seed=0)
    shaken = 1.0 if effects else 0.0
    rested = {"u": 0, "l": 0}
    for k in range(240):
        volts = (0.1, 0.1, 2.5, 2.5)[k // 60 % 4]
        *_, info = env.step(np.array([volts]))
        twist, omega_u, omega_l, theta_l = env.state
        string = rig.ktheta * twist + shaken * 5e-3 * (omega_u - omega_l)
        t = 0.05 * (k + 1)
        shakes = [
            0.1 * np.cos(2 * np.pi * 0.9 * t + 2.0),
            0.004 * np.cos(2 * np.pi * 1.3 * t + 0.4),
        ]
        truth = {
            "u": rig.km * volts - string + shaken * shakes[0],
            "l": string + shaken * (shakes[1] + 0.02 * np.cos(theta_l + 1.0)),
        }
        if omega_u != 0.0:
            side = np.sign(omega_u)
            truth["u"] = rig.Tsu * side + rig.dTsu + (rig.bu + side * rig.dbu) * omega_u
        if omega_l != 0.0:
            truth["l"] = np.sign(omega_l) * float(lower_curve(rig, abs(omega_l)))
        for disc, omega in (("u", omega_u), ("l", omega_l)):
            rested[disc] += omega == 0.0
            told = info[f"friction_torque_{disc}"]
            assert told == pytest.approx(truth[disc], abs=1e-9), (k, disc, omega)
    assert all(10 < many < 200 for many in rested.values())


def test_reset_clears_what_effects_remember():
    env = gym.make("DrillString-v0", rig=RIG)
    episodes = []
    for _ in range(2):
        first, _ = env.reset(seed=5)
        steps = [env.step(np.array([4.0], dtype=np.float32))[0] for _ in range(60)]
        episodes.append([first, *steps])
    np.testing.assert_array_equal(*episodes)


def test_encoder_error_is_there_from_the_start():
    env = gym.make("DrillString-v0", rig=RIG, encoder=Encoder(counts_per_rev=0), start="rest")
    observation, info = env.reset(seed=0)
    assert info["twist"] == 0.0
    assert observation[0] == pytest.approx(-0.05 * np.cos(0.3), rel=1e-5)
    assert observation[1] == observation[2] == 0.0


def test_all_plants_share_the_effects():
    env = gym.make("DrillString-v0", rig=RIG)
    env.reset(options={"rig": RIG.replace(bu=1.5)})
    with pytest.raises(InputError, match="gym.make"):
        env.reset(options={"rig": Rig()})
    with pytest.raises(InputError, match="gym.make"):
        gym.make("DrillString-v0").reset(options={"rig": RIG})


def test_wrong_effects_are_told_before_the_first_step():
    with pytest.raises(InputError, match="rig effect 1: id is 'x'"):
        gym.make("DrillString-v0", rig=Rig(effects=({"id": "x"},)))


def test_rig_without_effects_runs_none_of_their_code():
    assert EnvCore(EnvConfig(), 1).extension is None
