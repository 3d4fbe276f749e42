"""Trained policies behind the controllers' interface, on file and shipped with the package."""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
from pathlib import Path
from typing import Any, TypeAlias
from zipfile import ZipFile

import numpy as np

from drill_env._documents import read_json
from drill_env._errors import InputError
from drill_env._files import make_folder, replacing
from drill_env._types import FloatArray, PathLike
from drill_env.environment.config import EnvConfig, View

from .features import OUTPUT_BOUND, BothEncoders, Features, reference_table
from .network import Network
from .surface_features import SurfaceFilter

POLICY, SETTING = "policy.npz", "agent.json"
SHIPPED = Path(__file__).with_name("policies")

MOST_BYTES = 50_000_000
"""Bytes of a policy, packed and unpacked: the shipped ones have 28 thousand."""

# What the features say to a setting that fits no rig.
_UNFIT = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)

Document: TypeAlias = dict[str, Any]


class Agent:
    """A policy: fixed features, a small network, and a voltage made from its output.

    Args:
        network: from features to one output.
        features: what the network reads and what its output means.
        view: observation the features need.
        history: past frames in that observation.
        setting: what is kept in agent.json.
    """

    def __init__(
        self, network: Network, features: Features, view: View, history: int, setting: Document
    ) -> None:
        self.network, self.features = network, features
        self.view: View = view
        self.history: int = history
        self.setting = setting
        measured = 1 if view == "surface" else 3
        self._entries = measured + 2 + history * (measured + 1)

    def reset(self, n: int) -> None:
        """Forget what the features remember."""
        self.features.reset(n)

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltages (V) for observations in physical units, shape (n, d).

        Raises:
            InputError: the observation is not that of this agent's view and history.
        """
        if observation.shape[1] != self._entries:
            raise InputError(
                f"this agent reads {self._entries} numbers, the environment gives "
                f"{observation.shape[1]}: use observation={self.view!r}, history={self.history}"
            )
        output = self.network(self.features.read(observation))
        return self.features.volts(np.clip(output, -OUTPUT_BOUND, OUTPUT_BOUND))


class RememberingAgent(Agent):
    """An agent whose memory, two slow means, can be read and set: its loop can be continued."""

    features: BothEncoders  # pyright: ignore

    def memory(self) -> FloatArray:
        """Trim (V) and lean (rad), shape (n, 2)."""
        return self.features.memory()

    def recall(self, memory: FloatArray) -> None:
        """Continue from trims and leans, shape (n, 2)."""
        self.features.recall(memory)


def make_features(setting: Document, table: FloatArray | None = None) -> Features:
    """Features as agent.json describes them, for the nominal rig unless `table` is given."""
    history, limit = int(setting["history"]), float(setting["voltage_limit"])
    period = float(setting["control_period"])
    config = EnvConfig(
        observation=setting["view"], history=history, voltage_limit=limit, control_period=period
    )
    if setting["view"] == "surface":
        return SurfaceFilter(config, setting["filter"], table)
    table = reference_table(config) if table is None else table
    return BothEncoders(table, history, limit, period)


def feature_setting(view: View, history: int) -> Document:
    """What `make_features` needs, for training at the environment's own limit and period."""
    from drill_env.baselines.gains import tuned_gains

    config = EnvConfig()
    setting: Document = {
        "view": view, "history": history, "voltage_limit": config.voltage_limit,
        "control_period": config.control_period,
    }  # fmt: skip
    if view == "surface":
        setting["filter"] = tuned_gains("adaptive-ekf")
    return setting


def save_agent(
    layers: list[tuple[FloatArray, FloatArray]], setting: Document, folder: PathLike
) -> None:
    """Write a policy and what is needed to use it again into `folder`.

    Args:
        layers: weights (inputs, outputs) and biases of each layer.
        setting: `feature_setting` and whatever else is worth keeping.
        folder: made if it is not there.
    """
    path = make_folder(Path(folder))
    arrays: dict[str, Any] = {"reference": make_features(setting).table}
    for k, (weight, bias) in enumerate(layers):
        arrays[f"weight{k}"], arrays[f"bias{k}"] = np.float32(weight), np.float32(bias)
    # Put in place together: a policy beside the setting of another cannot be used.
    with replacing(path / SETTING) as setting_file, replacing(path / POLICY) as policy_file:
        with policy_file.open("wb") as stream:
            np.savez_compressed(stream, **arrays)
        digest = hashlib.sha256(policy_file.read_bytes()).hexdigest()
        whole = {**setting, "policy_sha256": digest}
        setting_file.write_text(json.dumps(whole, indent=2) + "\n", encoding="utf-8")


def names() -> list[str]:
    """Names of the shipped agents."""
    return sorted(path.parent.name for path in SHIPPED.glob(f"*/{SETTING}"))


def find(agent: PathLike) -> Path:
    """Folder of a shipped agent by its name, or of one that train.py wrote.

    Raises:
        InputError: there is neither.
    """
    path = Path(agent)
    if (path / SETTING).is_file():
        return path
    if str(agent) in names():
        return SHIPPED / str(agent)
    raise InputError(
        f"agent {agent}: neither a folder written by train.py ({POLICY} and {SETTING}) nor one of "
        f"the shipped ones: {', '.join(names())}"
    )


def load(agent: PathLike) -> Agent:
    """Read a shipped agent by its name, or one from the folder that `save_agent` wrote.

    Needs neither torch nor a network.

    Raises:
        InputError: there is no such agent, or its files are damaged.
    """
    path = find(agent)
    try:
        with (path / POLICY).open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise InputError(f"agent {agent}: no {POLICY} in {path}; train it again") from error
    setting = read_json(path / SETTING, f"agent {agent}: {SETTING}", "train it again")
    try:
        view, history = setting["view"], int(setting["history"])
        if setting["policy_sha256"] != hashlib.sha256(content).hexdigest():
            raise ValueError(f"it does not belong to this {POLICY}")
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(
            f"agent {agent}: {SETTING} is damaged ({error}); train it again"
        ) from error
    try:
        network, table = _read_policy(content)
        features = make_features(setting, table)
        if network.inputs != features.size:
            raise ValueError(f"{network.inputs} inputs for {features.size} features")
    except _UNFIT as error:
        raise InputError(f"agent {agent}: {POLICY} is damaged ({error}); train it again") from error
    kind = RememberingAgent if isinstance(features, BothEncoders) else Agent
    return kind(network, features, view, history, setting)


def _read_policy(content: bytes) -> tuple[Network, FloatArray]:
    """Network and reference table.

    Raises:
        ValueError: the archive is damaged or unpacks to too much.
    """
    try:
        arrays = _arrays(content)
    except Exception as error:
        # zip, zlib, numpy and the tokenizer of its headers each have errors of their own.
        raise ValueError(f"{type(error).__name__}: {error}") from error
    count = sum(name.startswith("weight") for name in arrays)
    layers = [(arrays[f"weight{k}"], arrays[f"bias{k}"]) for k in range(count)]
    return Network.of(layers), arrays["reference"]


def _arrays(content: bytes) -> dict[str, FloatArray]:
    with ZipFile(io.BytesIO(content)) as archive:
        unpacked = sum(item.file_size for item in archive.infolist())
    if max(len(content), unpacked) > MOST_BYTES:
        raise ValueError(f"more than {MOST_BYTES:.0e} bytes")
    # No pickles: an array of objects is an error.
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def describe(args: Any) -> Document:
    """A dataclass of arguments as plain values."""
    return {
        key: str(v) if isinstance(v, Path) else v for key, v in dataclasses.asdict(args).items()
    }
