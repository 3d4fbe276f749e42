"""Environments under fire: bad actions, copies, processes, random configurations."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest

from benchmarks.fuzz import environments as fire
from benchmarks.fuzz import long_runs
from benchmarks.fuzz.configurations import draw_options
from drill_env import InputError, Rig
from drill_env.environment import DrillStringEnv, DrillStringVectorEnv

sb3 = pytest.importorskip("drill_env.environment.sb3")

SEED = 20261125
TABLE = {
    "id": "table", "component": "upper", "depends_on": "theta_u", "sort": "torque",
    "knots": [0.0, 2.0, 4.0], "values": [0.02, -0.01, 0.02],
}  # fmt: skip


def kinds(**options: Any) -> list[Any]:
    """A started environment of each kind: scalar, vector, adapter."""
    found = [DrillStringEnv(**options), DrillStringVectorEnv(2, **options)]
    for env in found:
        env.reset(seed=SEED)
    adapter = sb3.DrillStringVecEnv(2, **options)
    adapter.seed(SEED)
    adapter.reset()
    return [*found, adapter]


@pytest.fixture(scope="module")
def started() -> list[Any]:
    return kinds(setpoint=3.0)


def for_kind(env: Any, action: Any) -> Any:
    """The action once for a scalar environment, else once for each of two rigs."""
    if isinstance(env, DrillStringEnv):
        return action
    return np.stack([action, action]) if isinstance(action, np.ndarray) else [action, action]


BAD = [
    np.array([np.nan]), np.array([np.inf]), np.array([-np.inf], dtype=np.float32), np.zeros(2),
    np.zeros(0), np.zeros((1, 2)), np.array([True]), "1.0", b"1", np.array(["1.0"]), None, object(),
    np.array([1.0], dtype=object), np.array([1j]), {}, {1.0}, [None], [[1.0], [1.0, 2.0]],
    np.array([1], dtype="m8[s]"), [10**400], np.zeros(1, dtype=[("a", "f8")]),
]  # fmt: skip


@pytest.mark.parametrize("action", BAD, ids=range(len(BAD)))
def test_what_is_no_action_is_refused_and_changes_nothing(started, action):
    for env in started:
        before = pickle.dumps(env)
        with pytest.raises(InputError, match=r"^action .*: give"):
            env.step(for_kind(env, action))
        if env is not started[2]:
            # The adapter keeps what it was given.
            assert pickle.dumps(env) == before


@pytest.mark.parametrize("unit", ["volts", "normalized"])
def test_actions_beyond_the_limit_are_clipped(unit):
    for action in (1e300, -1e300, np.float32(1e30), 10):
        for env in kinds(action=unit, setpoint=3.0):
            env.step(for_kind(env, np.array([action])))
            core = getattr(env, "env", env)._core
            assert set(core.row["voltage"]) == {np.sign(float(action)) * 5.0}


def test_step_before_reset():
    makers = (DrillStringEnv, lambda: DrillStringVectorEnv(2), lambda: sb3.DrillStringVecEnv(2))
    for env in [make() for make in makers]:
        with pytest.raises(InputError, match=r"call reset\(\)"):
            env.step(for_kind(env, np.zeros(1)))


def test_every_rig_must_be_reset_once():
    env = DrillStringVectorEnv(2)
    env.reset(seed=0, options={"reset_mask": np.array([True, False])})
    with pytest.raises(InputError, match="every environment"):
        env.step(np.zeros((2, 1)))
    env.reset(options={"reset_mask": np.array([False, True])})
    assert np.isfinite(env.step(np.zeros((2, 1)))[0]).all()


def test_a_step_after_the_end_goes_on_and_is_truncated_again():
    env, longer = (DrillStringEnv(setpoint=3.0, episode_seconds=s) for s in (0.5, 5.0))
    for each in (env, longer):
        each.reset(seed=SEED)
    for step in range(1, 30):
        a, b = (each.step(np.array([3.0])) for each in (env, longer))
        assert a[0].tobytes() == b[0].tobytes() and a[1] == b[1]
        assert a[3] == (step >= 10) and not b[3]


RESETS = [
    {"setpoint": "x"}, {"schedule": 3}, {"friction_step": 1}, {"delay_s": -1}, {"rig": 3},
    {"rig": Rig.one_inertia(km=1.0, Ju=1.0, Tsu=0.1, bu=0.2)}, {"start": "foo"}, {"state": [1]},
    {"phase": 7}, {"state": [0, 0, 0], "start": "ring"}, {"colour": 1}, {3: 1, "a": 2}, "x", [1], 3,
]  # fmt: skip


@pytest.mark.parametrize("options", RESETS, ids=lambda o: repr(o)[:30])
def test_a_reset_that_is_refused_changes_nothing(started, options):
    for env in started[:2]:
        before = pickle.dumps(env)
        with pytest.raises(InputError):
            env.reset(seed=1, options=options)
        assert pickle.dumps(env) == before


@pytest.mark.parametrize("seed", [-1, 1.5, "abc", True, [1], {1: 2}])
def test_seeds_that_are_none(started, seed):
    for env in started[:2]:
        before = pickle.dumps(env)
        with pytest.raises(InputError, match="seed"):
            env.reset(seed=seed)
        assert pickle.dumps(env) == before


def test_numpy_seeds_are_seeds():
    a = DrillStringVectorEnv(3).reset(seed=np.int64(4))[0]
    b = DrillStringVectorEnv(3).reset(seed=np.array([4, 5, 6]))[0]
    assert a.tobytes() == b.tobytes() == DrillStringVectorEnv(3).reset(seed=4)[0].tobytes()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"num_envs": 2.5}, "num_envs is 2.5"), ({"num_envs": "3"}, "num_envs is '3'"),
        ({"num_envs": True}, "num_envs is True"), ({"num_envs": 10**13}, "num_envs is 1000000"),
        ({"autoreset_mode": "x"}, "autoreset_mode is 'x'"), ({"truth": "no"}, "truth is 'no'"),
        ({"num_envs": 2, "start": "state"}, "start is state"),
    ],
)  # fmt: skip
def test_absurd_options_of_a_vector_environment(options, words):
    with pytest.raises(InputError, match=words):
        DrillStringVectorEnv(**options)


def test_masks_are_truth_values(started):
    for mask in ([0, 1], "ab", None, [True]):
        with pytest.raises(InputError, match="reset_mask"):
            started[1].reset(options={"reset_mask": mask})


def test_each_rig_of_the_adapter_gets_its_own_options():
    env = sb3.DrillStringVecEnv(2)
    env.set_options([{"setpoint": 2.0}, {"setpoint": 5.0}])
    assert env.reset()[:, 3].tolist() == [2.0, 5.0]


def test_an_environment_that_has_drawn_can_be_copied():
    pytest.importorskip("pygame")
    env = DrillStringEnv("rgb_array", setpoint=3.0)
    env.reset(seed=SEED)
    env.render()
    copies = copy.deepcopy(env), pickle.loads(pickle.dumps(env))
    wanted = env.step(np.array([3.0]))[0].tobytes()
    for other in copies:
        assert other.step(np.array([3.0]))[0].tobytes() == wanted
        assert other.render().shape == env.render().shape


def test_effects_of_the_sensors_alone():
    """Their motion is that of the rig without; this once ended the process."""
    effect = {"id": "encoder_gain_lower", "error": 0.01}
    one, plain = (DrillStringEnv(setpoint=3.0, rig=Rig(effects=e)) for e in ((effect,), ()))
    for env in (one, plain):
        env.reset(seed=SEED)
    for _ in range(60):
        a, b = (env.step(np.array([3.0]))[4] for env in (one, plain))
        for name in ("omega_l", "friction_torque_l", "friction_torque_u"):
            assert a[name] == pytest.approx(b[name], abs=1e-9)
    assert abs(one.step(np.array([3.0]))[0][0] - plain.step(np.array([3.0]))[0][0]) > 1e-3


def test_a_table_lives_as_long_as_its_environment():
    """Its numbers were once freed while the environment read them."""
    env = DrillStringEnv(setpoint=3.0, rig=Rig(effects=(TABLE,)), rtol=1e-9)
    env.reset(seed=SEED)
    speeds = [env.step(np.array([3.0]))[4]["omega_u"] for _ in range(40)]
    from drill_env.integrator import simulate

    truth = simulate(env.rig, 3.0, 2.0, rate=20.0)
    np.testing.assert_allclose(speeds, truth.omega_u[1:], atol=1e-5)


@pytest.mark.parametrize("number", range(25))
def test_scalar_vector_adapter_and_copies_give_the_same_bits(number):
    found = fire.verdict(SEED, number)
    assert not found["fault"], found


def test_the_comparison_tells_a_single_bit():
    options = draw_options(np.random.default_rng(SEED)) | {"observation": "state"}
    actions = fire.draw_actions(np.random.default_rng(0), options, fire.STEPS)
    other = actions.copy()
    other[4] = np.nextafter(actions[4], np.float32(0.0))
    envs = [DrillStringVectorEnv(fire.RIGS, **options) for _ in range(2)]
    runs = [
        fire.vector_steps(env, each, fire.started(env, 1))
        for env, each in zip(envs, (actions, other), strict=True)
    ]
    with pytest.raises(AssertionError, match="differs"):
        fire.same(*runs)


@pytest.mark.parametrize(
    ("workers", "context"),
    [
        (fire.gymnasium_workers, "fork"), (fire.gymnasium_workers, "spawn"),
        (fire.sb3_workers, "fork"),
    ],
)  # fmt: skip
def test_processes_give_the_same_bits(workers, context):
    workers({"uncertainty": "L3", "start": "ring", "encoder": {"noise_rad": 1e-3}}, SEED, context)


def test_many_steps_grow_no_memory_and_shift_no_time():
    grown, changed = long_runs.long_run(10_000, SEED)
    assert grown < long_runs.MOST_GROWN and changed < long_runs.MOST_CHANGED


def test_many_rigs_that_restart_grow_no_memory():
    assert long_runs.crowd_run(2_000, 64, SEED) < long_runs.MOST_GROWN


def test_what_is_kept_is_seen(monkeypatch):
    kept, draw = [], long_runs.DrillStringVectorEnv.step

    def step(self, actions):
        # More than what tests before have left free.
        kept.append(np.ones(100_000))
        return draw(self, actions)

    monkeypatch.setattr(long_runs.DrillStringVectorEnv, "step", step)
    assert long_runs.crowd_run(2_000, 8, SEED) > long_runs.MOST_GROWN


@pytest.mark.parametrize("number", [311, 409])
def test_contact_that_ages_stays_finite_where_a_step_passes_rest(number):
    """Its age was once asked for at a speed beyond rest, where it has no logarithm."""
    found = fire.verdict(2, number)
    assert not found["fault"], found
