"""Harnesses of trained agents: a policy's folder and a training's checkpoint."""

from __future__ import annotations

import functools
import hashlib
import io
import json
import zipfile
from pathlib import Path

import numpy as np

from benchmarks.fuzz.dice import Dice
from benchmarks.fuzz.inputs import mutated
from benchmarks.fuzz.judge import Harness
from drill_env.agents import find, load

SHIPPED = find("encoders-ppo")
SETTING = (SHIPPED / "agent.json").read_bytes()


def policy(*, packed: bool) -> bytes:
    """A small network under the shipped setting."""
    with np.load(SHIPPED / "policy.npz") as arrays:
        kept = {name: arrays[name] for name in arrays.files}
    out = io.BytesIO()
    (np.savez_compressed if packed else np.savez)(out, **kept)
    return out.getvalue()


def read_policy(folder: Path, given: tuple[bytes, bytes, bool]) -> None:
    """An agent's folder whose sums fit, if the setting can still be read."""
    setting, content, mend = given
    if mend:
        try:
            document = json.loads(setting)
            document["policy_sha256"] = hashlib.sha256(content).hexdigest()
            setting = json.dumps(document).encode()
        except (ValueError, TypeError, RecursionError):
            pass
    (folder / "policy.npz").write_bytes(content)
    (folder / "agent.json").write_bytes(setting)
    agent = load(folder)
    assert np.isfinite(agent.network(np.zeros((1, agent.network.inputs)))).all()


POLICIES = (policy(packed=False), policy(packed=True))


def agent(dice: Dice) -> tuple[bytes, bytes, bool]:
    """A setting and a network, of which at least one is damaged, and whether the sum is mended."""
    sort = dice.whole(0, 2)
    setting = mutated(dice, (SETTING,), text=True) if sort != 0 else SETTING
    content = mutated(dice, POLICIES, text=False) if sort != 1 else POLICIES[1]
    return setting, content, dice.chance(0.75)


POLICY = Harness("policy", agent, read_policy)


def checkpoint() -> bytes:
    """An archive as Stable-Baselines3 writes it, with a small network."""
    import torch

    out, state = io.BytesIO(), io.BytesIO()
    torch.save({"weight": torch.ones(2, 3)}, state)
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("data", json.dumps({"num_timesteps": 100}))
        archive.writestr("policy.pth", state.getvalue())
    return out.getvalue()


def read_archive(folder: Path, content: bytes) -> None:
    """A checkpoint."""
    from drill_env.agents.checkpoint import read_checkpoint

    path = folder / "checkpoint.zip"
    path.write_bytes(content)
    steps, _ = read_checkpoint(path)
    assert 0 <= steps < 2**63


@functools.cache
def checkpoints() -> tuple[bytes, ...]:
    """Made when they are asked for: torch takes seconds to load."""
    return (checkpoint(),)


CHECKPOINT = Harness(
    "checkpoint", lambda dice: mutated(dice, checkpoints(), text=False), read_archive
)
