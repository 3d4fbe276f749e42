r"""Train a PPO agent on the drill-string rig and put it on the table.

The shipped agent with both encoders, some four minutes:

    python train.py --out runs/encoders-ppo

The shipped agent that sees the upper encoder alone:

    python train.py --view surface --history 4 --episode-seconds 25 --gamma 0.99 \
        --log-std-init -3 --learning-rate 0.0005 --batch-size 6400 --total-steps 16000000 \
        --out runs/surface-ppo

A look at how it runs, too short to learn the task:

    python train.py --total-steps 200000 --out runs/short

Go on after an interruption (Ctrl-C keeps the last checkpoint); repeat the other options:

    python train.py --out runs/encoders-ppo --resume

Show it among the classical controllers:

    drill-env compare --levels L0,L1,L2,L3 --controllers lqi --agent runs/encoders-ppo
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import drill_env  # noqa: F401
from drill_env import InputError
from drill_env._ending import ending_tidily

CHECKPOINT = "checkpoint.zip"
PERIOD = 0.05
# What changes nothing about the agent.
UNTOLD = ("resume", "tensorboard", "skip_table")
BESIDE = ("open-loop", "pi", "active-damping", "lqi", "adaptive-ekf")


@dataclass
class Args:
    """Arguments; every field is an option of the same name."""

    out: Path = Path("runs/encoders-ppo")
    """folder of the agent, its checkpoints and its logs"""
    seed: int = 1
    """seed of the network, the sampling and the environments"""
    resume: bool = False
    """go on from the last checkpoint in --out"""
    view: str = "both"
    """observation: both (encoders) or surface (upper one alone)"""
    history: int = 6
    """past frames in the observation"""
    uncertainty: str = "mixed"
    """plants met in training: L0 to L3, or mixed"""
    episode_seconds: float = 10.0
    """length of a training episode, s"""
    total_steps: int = 20_000_000
    """environment steps"""
    num_envs: int = 256
    """rigs simulated side by side; an update follows each episode of all of them"""
    batch_size: int = 5120
    """samples per gradient step"""
    n_epochs: int = 4
    """passes over each roll-out"""
    learning_rate: float = 1e-3
    """of Adam, falling linearly to a twentieth"""
    gamma: float = 0.985
    """discount per control period"""
    gae_lambda: float = 0.95
    """of the advantage estimate"""
    ent_coef: float = 0.0
    """weight of the entropy bonus"""
    log_std_init: float = -1.0
    """logarithm of the first exploration noise"""
    hidden: int = 64
    """units in each of two hidden layers"""
    checkpoint_steps: int = 500_000
    """steps between checkpoints"""
    tensorboard: bool = False
    """write TensorBoard logs into --out"""
    skip_table: bool = False
    """do not compare the agent with classical controllers at the end"""


def parse(argv: list[str]) -> Args:
    """Command line to arguments; the help texts are the fields' docstrings."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        usage="python train.py [options], see --help",
    )  # fmt: skip
    texts = _field_texts()
    for item in fields(Args):
        default = item.default
        name, text = "--" + item.name.replace("_", "-"), f"{texts[item.name]} (default: {default})"
        if isinstance(default, bool):
            parser.add_argument(name, action="store_true", help=text)
        else:
            parser.add_argument(name, type=type(default), default=default, help=text)
    args = Args(**vars(parser.parse_args(argv)))
    check(args)
    return args


def check(args: Args) -> None:
    """Refuse what could only fail later.

    Raises:
        InputError: a number is out of range, or --out cannot be a folder.
    """
    for name in ("total_steps", "num_envs", "n_epochs", "hidden", "checkpoint_steps"):
        if getattr(args, name) < 1:
            option = "--" + name.replace("_", "-")
            raise InputError(f"{option} is {getattr(args, name)}: give 1 or more")
    if args.view not in ("both", "surface"):
        raise InputError(f"--view is {args.view!r}: give one of both, surface")
    if args.uncertainty not in ("mixed", "L0", "L1", "L2", "L3"):
        raise InputError(f"--uncertainty is {args.uncertainty!r}: give mixed or L0 to L3")
    if not 0.05 <= args.episode_seconds <= 1000.0:
        raise InputError(f"--episode-seconds is {args.episode_seconds}: give 0.05 to 1000")
    if not 2 <= args.batch_size <= rollout(args):
        raise InputError(
            f"--batch-size is {args.batch_size}: give 2 to the steps of one episode of all rigs, "
            f"{rollout(args)}"
        )
    if not 0.0 < args.learning_rate < 1.0:
        raise InputError(f"--learning-rate is {args.learning_rate}: give 0 to 1")
    nearest = next(p for p in (args.out, *args.out.absolute().parents) if p.exists())
    if not (nearest.is_dir() and os.access(nearest, os.W_OK)):
        raise InputError(f"--out {args.out}: {nearest} is no writable folder; give another one")
    if args.resume and not (args.out / CHECKPOINT).is_file():
        raise InputError(f"--resume: {args.out / CHECKPOINT} is not there; start without --resume")


def rollout(args: Args) -> int:
    """Steps between two updates: an episode of all rigs."""
    return args.num_envs * max(1, round(args.episode_seconds / PERIOD))


def _field_texts() -> dict[str, str]:
    lines = Path(__file__).read_text(encoding="utf-8").splitlines()
    names = {item.name for item in fields(Args)}
    found = {}
    for line, after in zip(lines, lines[1:], strict=False):
        name = line.strip().split(":")[0]
        if name in names and after.strip().startswith('"""'):
            found.setdefault(name, after.strip().strip('"'))
    return found


def make_env(args: Args) -> Any:
    """The training task."""
    from drill_env.agents.policy import feature_setting, make_features
    from drill_env.agents.training_env import TaskEnv, rigs

    features = make_features(feature_setting(args.view, args.history))  # pyright: ignore
    env = rigs(args.view, args.history, args.uncertainty, args.num_envs)  # pyright: ignore
    return TaskEnv(env, features, args.episode_seconds, args.seed)


def make_model(args: Args, env: Any) -> Any:
    """A fresh model, or the last checkpoint."""
    from stable_baselines3 import PPO

    from drill_env.agents.actor_critic import PlantCritic

    log = str(args.out) if args.tensorboard else None
    model = PPO(
        PlantCritic, env, seed=args.seed, device="cpu", tensorboard_log=log,
        n_steps=env.length, batch_size=args.batch_size, n_epochs=args.n_epochs,
        learning_rate=lambda left: args.learning_rate * (0.05 + 0.95 * left),
        gamma=args.gamma, gae_lambda=args.gae_lambda, ent_coef=args.ent_coef,
        stats_window_size=args.num_envs,
        policy_kwargs={
            "seen": env.features.size, "hidden": args.hidden, "log_std_init": args.log_std_init,
        },
    )  # fmt: skip
    if args.resume:
        _go_on(model, args)
        # The seed alone would repeat the noise and the plants of the first part.
        model.set_random_seed(args.seed + model.num_timesteps)
        env.start_again(args.seed + model.num_timesteps)
    return model


def _go_on(model: Any, args: Args) -> None:
    """Put weights, optimiser and steps of the last checkpoint into a fresh model.

    A checkpoint of Stable-Baselines3 also holds pickled objects, which can run any code when
    they are loaded; they are left alone, and torch reads weights alone.
    """
    from drill_env.agents.checkpoint import read_checkpoint

    checkpoint = args.out / CHECKPOINT
    steps, parameters = read_checkpoint(checkpoint)
    try:
        model.set_parameters(parameters, exact_match=True, device="cpu")
    except (AttributeError, KeyError, RuntimeError, TypeError, ValueError) as error:
        raise InputError(
            f"--resume: {checkpoint} does not fit ({error}); give the --view, --history, "
            "--hidden it was trained with, or start without --resume"
        ) from error
    model.num_timesteps = steps


def train(args: Args) -> None:
    """Train from scratch or go on, and save the agent.

    Raises:
        InputError: the extra ``agents`` is not installed, or a checkpoint does not fit.
    """
    from rich.console import Console

    try:
        import torch

        from drill_env.agents.actor_critic import actor_layers
    except ImportError as error:
        raise InputError("training needs torch: pip install 'drill-env[agents]'") from error
    from drill_env.agents.policy import describe, feature_setting, save_agent
    from drill_env.agents.progress import TrainingProgress

    # Networks this small lose more than they gain on several threads.
    torch.set_num_threads(1)
    console = Console(stderr=True)
    model = make_model(args, make_env(args))
    left = args.total_steps - model.num_timesteps
    watch = TrainingProgress(args.total_steps, args.out, args.checkpoint_steps, console)
    if left <= 0:
        console.print(f"already trained for {model.num_timesteps} steps")
    else:
        with watch.interruptible():
            model.learn(left, callback=watch, reset_num_timesteps=not args.resume)
        if watch.interrupted:
            console.print(f"stopped after {model.num_timesteps} steps; go on with --resume")
            sys.exit(130)
    setting = feature_setting(args.view, args.history)  # pyright: ignore
    notes = {
        "trained_steps": model.num_timesteps, "seconds": watch.seconds,
        "cpu_seconds": watch.cpu_seconds, **describe(args),
    }  # fmt: skip
    save_agent(actor_layers(model), {**setting, **notes, "command": command(args)}, args.out)


def command(args: Args) -> str:
    """The command that makes the same agent again."""
    changed = [
        f"--{item.name.replace('_', '-')} {getattr(args, item.name)}"
        for item in fields(Args)
        if item.name not in UNTOLD and getattr(args, item.name) != item.default
    ]
    return " ".join(["python train.py", *changed])


def main(args: Args) -> None:
    """Train, then show the agent beside some classical controllers."""
    from rich.console import Console

    from drill_env import baselines
    from drill_env._tables import write_table
    from drill_env.agents.policy import load
    from drill_env.benchmark import compare
    from drill_env.environment.config import EnvConfig
    from drill_env.report.compare_table import compare_table

    train(args)
    if args.skip_table:
        return
    shown = {name: baselines.CONTROLLERS[name] for name in BESIDE}
    table = compare({**shown, "ppo": lambda _: load(args.out)}, EnvConfig())
    write_table(table, args.out / "compare.csv")
    Console(width=None if sys.stdout.isatty() else 120).print(compare_table(table))


if __name__ == "__main__":
    with ending_tidily():
        try:
            main(parse(sys.argv[1:]))
        except InputError as error:
            print(f"error: {error}", file=sys.stderr)
            sys.exit(2)
        except KeyboardInterrupt:
            print("interrupted", file=sys.stderr)
            sys.exit(130)
