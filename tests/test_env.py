"""The Gymnasium environment as its users call it."""

from __future__ import annotations

import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import drill_env  # noqa: F401
from drill_env import InputError, Rig
from drill_env.dynamics import equilibrium_voltage
from drill_env.friction import lower_curve
from drill_env.integrator import simulate
from drill_env.sensors import Encoder, filter_velocity, read_encoder

IDS = ("DrillString-v0", "DrillStringSurface-v0")


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("options", [{}, {"history": 3}, {"uncertainty": "L3", "start": "random"}])
def test_checkers_of_gymnasium_and_sb3_are_silent(name: str, options: dict) -> None:
    from stable_baselines3.common.env_checker import check_env as check_sb3

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gym.make(name, action="normalized", **options)
        check_env(env.unwrapped, skip_render_check=False)
        check_sb3(env.unwrapped)


def test_actions_in_volts_draw_only_the_advice_to_normalize() -> None:
    env = gym.make("DrillString-v0")
    assert env.action_space.low[0] == -5.0 and env.action_space.high[0] == 5.0
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env.unwrapped)
    assert {"normalized space" in str(w.message) for w in caught} == {True}


def test_steps_are_the_exact_simulation() -> None:
    """Truth in `info` against one run of the integrator at tight tolerance."""
    env = gym.make("DrillString-v0", setpoint=4.0, rtol=1e-9, method="dop853")
    env.reset(seed=1)
    truth = simulate(Rig(), 3.5, 30.0, rate=20.0)
    for k in range(1, 601):
        observation, _, _, _, info = env.step(np.array([3.5], dtype=np.float32))
        assert info["omega_l"] == pytest.approx(truth.omega_l[k], abs=1e-6)
        assert info["theta_u"] == pytest.approx(truth.theta_u[k], abs=1e-6)
        assert info["stuck_l"] == truth.stuck_l[k]
    assert observation[3] == np.float32(4.0) and observation[4] == np.float32(3.5)


def test_default_tolerance_is_finer_than_a_count() -> None:
    env = gym.make("DrillString-v0", setpoint=4.0)
    env.reset(seed=1)
    truth = simulate(Rig(), 3.5, 60.0, rate=20.0)
    worst = 0.0
    for k in range(1, 1201):
        info = env.step(np.array([3.5], dtype=np.float32))[4]
        worst = max(worst, abs(info["theta_l"] - truth.theta_l[k]))
    assert worst < Encoder().quantum


def test_observation_is_what_the_encoders_give() -> None:
    """The env's velocities against the series functions of `drill_env.sensors`."""
    encoder = Encoder(counts_per_rev=2000, rate_hz=200.0, cutoff_hz=8.0)
    env = gym.make("DrillString-v0", setpoint=4.0, encoder=encoder, rtol=1e-9, method="dop853")
    env.reset(seed=1)
    truth = simulate(Rig(), 3.5, 20.0, rate=200.0)
    angle = read_encoder(truth.theta_l, encoder)
    speed = filter_velocity(angle, encoder)
    twist = read_encoder(truth.theta_u, encoder) - angle
    for k in range(10, 4001, 10):
        observation = env.step(np.array([3.5], dtype=np.float32))[0]
        # One count of disagreement can come from the tolerance: a count moves the filter a little.
        assert observation[2] == pytest.approx(speed[k], abs=0.2)
        assert observation[0] == pytest.approx(twist[k], abs=1.01 * encoder.quantum)


def test_reward_is_best_on_the_set_point_and_parts_add_up() -> None:
    env = gym.make("DrillString-v0", setpoint=5.0, start="equilibrium")
    env.reset(seed=0)
    volts = np.array([equilibrium_voltage(Rig(), 5.0)], dtype=np.float32)
    _, steady, _, _, info = env.step(volts)
    assert steady == pytest.approx(1.0, abs=1e-6)
    parts = [value for name, value in info.items() if name.startswith("reward_")]
    assert steady == pytest.approx(sum(parts))
    env.reset(options={"start": "limit_cycle", "phase": 0.5})
    assert env.step(volts)[1] < steady - 0.5


def test_starts() -> None:
    env = gym.make("DrillString-v0", setpoint=5.0)
    _, info = env.reset(seed=0)
    assert info["omega_l"] == 0.0 and info["stuck_l"]
    _, info = env.reset(options={"start": "equilibrium"})
    assert info["omega_l"] == info["omega_u"] == 5.0
    _, info = env.reset(options={"state": [0.3, 1.0, 2.0]})
    assert (info["twist"], info["omega_u"], info["omega_l"]) == (0.3, 1.0, 2.0)
    volts = float(equilibrium_voltage(Rig(), 5.0))
    cycle = simulate(Rig(), volts, 60.0, rate=1000.0).omega_l[-5000:]
    _, info = env.reset(options={"start": "limit_cycle", "phase": 0.0})
    assert info["omega_l"] == pytest.approx(cycle.max(), abs=1e-4)


def test_schedule_and_friction_step_take_effect() -> None:
    env = gym.make("DrillString-v0", schedule=[(0.0, 2.0), (1.0, 6.0)], start="equilibrium")
    _, info = env.reset(seed=0, options={"friction_step": ((2.0, 2.0), (3.0, 3.0))})
    assert info["setpoint"] == 2.0
    seen, torque = [], []
    for _ in range(60):
        info = env.step(np.array([1.4], dtype=np.float32))[4]
        seen.append(info["setpoint"])
        torque.append(info["friction_torque_l"])
    assert seen[:20] == [2.0] * 20 and seen[20:] == [6.0] * 40
    assert torque[40] > 2.0 * torque[39]


def test_friction_step_at_the_start_is_applied_once() -> None:
    """At time 0 the step must scale the friction as it does at any other time."""
    volts = np.array([1.4], dtype=np.float32)
    torques = []
    for friction_step in (None, ((0.0, 0.0), (2.0, 2.0))):
        env = gym.make("DrillString-v0", setpoint=2.0)
        env.reset(seed=0, options={"start": "equilibrium", "friction_step": friction_step})
        info = env.step(volts)[4]
        torques.append(float(lower_curve(Rig(), info["omega_l"])))
        torques.append(info["friction_torque_l"])
    assert torques[1] == pytest.approx(torques[0], rel=1e-9)
    assert torques[3] == pytest.approx(2.0 * torques[2], rel=1e-9)


def test_truncates_at_the_end_and_never_terminates() -> None:
    env = gym.make("DrillString-v0", episode_seconds=2.0, control_period=0.1)
    env.reset(seed=0)
    flags = [env.step(env.action_space.sample())[2:4] for _ in range(20)]
    assert flags == [(False, False)] * 19 + [(False, True)]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"control_period": 0.5}, "0.01 to 0.2"),
        ({"voltage_limit": 20.0}, "voltage_limit"),
        ({"observation": "downhole"}, "both, surface, state"),
        ({"uncertainty": "L9"}, "L0, L1, L2, L3"),
        ({"setpoint": -1.0}, "setpoint"),
        ({"colour": "red"}, "unknown option colour"),
        ({"encoder": Encoder(rate_hz=33.0)}, "whole number of samples"),
    ],
)
def test_bad_options_name_the_remedy(options: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        gym.make("DrillString-v0", **options)


def test_delay_makes_the_sensors_late() -> None:
    prompt = gym.make("DrillString-v0", setpoint=4.0)
    late = gym.make("DrillString-v0", setpoint=4.0, encoder=Encoder(delay_s=0.1))
    prompt.reset(seed=0)
    late.reset(seed=0)
    action = np.array([4.0], dtype=np.float32)
    a = [prompt.step(action)[0][:3] for _ in range(100)]
    b = [late.step(action)[0][:3] for _ in range(100)]
    np.testing.assert_array_equal(np.array(a[:-2]), np.array(b[2:]))


def test_noise_and_missed_counts_are_seeded() -> None:
    noisy = Encoder(noise_rad=2e-3, missed_per_count=1e-2)
    runs = []
    for seed in (5, 5, 6):
        env = gym.make("DrillString-v0", setpoint=4.0, encoder=noisy)
        env.reset(seed=seed)
        runs.append([env.step(np.array([3.0], dtype=np.float32))[0] for _ in range(300)])
    np.testing.assert_array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])
    exact = gym.make("DrillString-v0", setpoint=4.0)
    exact.reset(seed=5)
    info = [exact.step(np.array([3.0], dtype=np.float32))[4] for _ in range(300)][-1]
    # One count in a hundred lost on either disc: the two losses nearly cancel in the twist.
    lost = abs(runs[0][-1][0] - info["twist"])
    assert 0.0 < lost < 0.05 * abs(info["theta_u"])
