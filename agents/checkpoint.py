"""Checkpoints of a training, read without trust: weights and the count of steps alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from drill_env._errors import InputError

MOST_BYTES = 500_000_000
"""Bytes of the unpacked checkpoint: weights and two moments of Adam for 40 million parameters, a
thousand times the largest network that was ever trained on the rig."""


def read_checkpoint(path: Path) -> tuple[int, dict[str, Any]]:
    """Steps done, and the state of policy and optimiser by name.

    Nothing in the file is unpickled but tensors: of the data beside them, which
    Stable-Baselines3 keeps as pickles in JSON, only the count of steps is read, as a number.

    Args:
        path: of the file that `train.py` wrote.

    Raises:
        InputError: it is damaged, too large, or holds more than weights.
    """
    import torch
    from stable_baselines3.common.save_util import load_from_zip_file

    try:
        with ZipFile(path) as archive:
            unpacked = sum(item.file_size for item in archive.infolist())
            if unpacked > MOST_BYTES:
                raise InputError(
                    f"--resume: {path} unpacks to {unpacked} bytes, too many for a checkpoint; "
                    "start without --resume"
                )
            steps = json.loads(archive.read("data").decode("utf-8"))["num_timesteps"]
        if type(steps) is not int or not 0 <= steps < 2**63:
            raise ValueError(f"num_timesteps is {steps!r}")
        # Loads with weights_only=True.
        _, parameters, _ = load_from_zip_file(path, load_data=False, device="cpu")
    except InputError:
        raise
    except Exception as error:
        # Whatever zip, JSON or torch say to damaged bytes, and torch to pickled code.
        raise InputError(
            f"--resume: {path} is damaged or no checkpoint of train.py "
            f"({type(error).__name__}); start without --resume"
        ) from error
    for name, state in parameters.items():
        if not all(torch.isfinite(t).all() for t in _tensors(state)):
            raise InputError(f"--resume: {path}: {name} holds NaN; start without --resume")
    return steps, dict(parameters)


def _tensors(state: Any) -> list[Any]:
    import torch

    if isinstance(state, torch.Tensor):
        return [state]
    if isinstance(state, dict):
        return [t for item in state.values() for t in _tensors(item)]
    return [t for item in state for t in _tensors(item)] if isinstance(state, list) else []
