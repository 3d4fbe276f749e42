"""Train a PPO agent on the drill-string rig and put it on the table.

The agent of the README's picture, three million steps:

    python train.py --out runs/ppo

A look at how it runs, too short to learn the task:

    python train.py --total-steps 200000 --out runs/short

Upper encoder alone, with history; this one does not learn to end the vibration:

    python train.py --view surface --history 8 --total-steps 6000000 --out runs/surface-ppo

Go on after an interruption (Ctrl-C keeps the last checkpoint):

    python train.py --out runs/ppo --resume

Show it among the classical controllers:

    drill-env compare --agent runs/ppo --out out/compare
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import drill_env  # noqa: F401
from drill_env import InputError

CHECKPOINT = "checkpoint.zip"


@dataclass
class Args:
    """Arguments; every field is an option of the same name."""

    out: Path = Path("runs/ppo")
    """folder of the agent, its checkpoints and its logs"""
    seed: int = 1
    """seed of the network, the sampling and the environments"""
    resume: bool = False
    """go on from the last checkpoint in --out"""
    view: str = "both"
    """observation: both (encoders) or surface (upper one alone)"""
    history: int = 0
    """past frames in the observation"""
    uncertainty: str = "L1"
    """plants met in training: L0 to L3"""
    episode_seconds: float = 30.0
    """length of a training episode, s"""
    total_steps: int = 3_000_000
    """environment steps"""
    num_envs: int = 256
    """rigs simulated side by side"""
    n_steps: int = 64
    """steps per rig and update"""
    batch_size: int = 4096
    """samples per gradient step"""
    n_epochs: int = 6
    """passes over each roll-out"""
    learning_rate: float = 1e-3
    """of Adam, falling linearly to a tenth"""
    gamma: float = 0.98
    """discount per control period"""
    gae_lambda: float = 0.95
    """of the advantage estimate"""
    ent_coef: float = 0.0
    """weight of the entropy bonus"""
    log_std_init: float = -0.7
    """logarithm of the first exploration noise"""
    hidden: int = 64
    """units in each of two hidden layers"""
    checkpoint_steps: int = 250_000
    """steps between checkpoints"""
    tensorboard: bool = False
    """write TensorBoard logs into --out"""


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
    for name in ("total_steps", "num_envs", "n_steps", "n_epochs", "hidden", "checkpoint_steps"):
        if getattr(args, name) < 1:
            option = "--" + name.replace("_", "-")
            raise InputError(f"{option} is {getattr(args, name)}: give 1 or more")
    if not 2 <= args.batch_size <= args.num_envs * args.n_steps:
        raise InputError(
            f"--batch-size is {args.batch_size}: give 2 to --num-envs times --n-steps, "
            f"{args.num_envs * args.n_steps}"
        )
    if not 0.0 < args.learning_rate < 1.0:
        raise InputError(f"--learning-rate is {args.learning_rate}: give 0 to 1")
    nearest = next(p for p in (args.out, *args.out.absolute().parents) if p.exists())
    if not (nearest.is_dir() and os.access(nearest, os.W_OK)):
        raise InputError(f"--out {args.out}: {nearest} is no writable folder; give another one")
    if args.resume and not (args.out / CHECKPOINT).is_file():
        raise InputError(f"--resume: {args.out / CHECKPOINT} is not there; start without --resume")


def _field_texts() -> dict[str, str]:
    lines = Path(__file__).read_text(encoding="utf-8").splitlines()
    names = {item.name for item in fields(Args)}
    found = {}
    for line, after in zip(lines, lines[1:], strict=False):
        name = line.strip().split(":")[0]
        if name in names and after.strip().startswith('"""'):
            found.setdefault(name, after.strip().strip('"'))
    return found


def make_env(args: Args) -> tuple[Any, Any]:
    """The training environment and its configuration."""
    from drill_env.agents.policy import observation_scale
    from drill_env.agents.scaled_env import ScaledObservations
    from drill_env.environment.config import EnvConfig
    from drill_env.environment.sb3 import DrillStringVecEnv

    options = {
        "observation": args.view, "history": args.history, "uncertainty": args.uncertainty,
        "episode_seconds": args.episode_seconds, "start": "random", "action": "normalized",
    }  # fmt: skip
    config = EnvConfig.from_options(options)
    env = DrillStringVecEnv(args.num_envs, **options)
    env.seed(args.seed)
    return ScaledObservations(env, observation_scale(config)), config


def make_model(args: Args, env: Any) -> Any:
    """A fresh model, or the last checkpoint."""
    from stable_baselines3 import PPO

    log = str(args.out) if args.tensorboard else None
    if args.resume:
        checkpoint = args.out / CHECKPOINT
        try:
            model = PPO.load(checkpoint, env=env, device="cpu", tensorboard_log=log)
        except (AssertionError, ValueError, BadZipFile) as error:
            raise InputError(
                f"--resume: {checkpoint} does not fit ({error}); give the --view, --history, "
                "--num-envs it was trained with, or start without --resume"
            ) from error
        # The seed alone would repeat the noise and the plants of the first part.
        model.set_random_seed(args.seed + model.num_timesteps)
        return model
    return PPO(
        "MlpPolicy", env, seed=args.seed, device="cpu", tensorboard_log=log,
        n_steps=args.n_steps, batch_size=args.batch_size, n_epochs=args.n_epochs,
        learning_rate=lambda left: args.learning_rate * (0.1 + 0.9 * left),
        gamma=args.gamma, gae_lambda=args.gae_lambda, ent_coef=args.ent_coef,
        policy_kwargs={"net_arch": [args.hidden, args.hidden], "log_std_init": args.log_std_init},
    )  # fmt: skip


def main(args: Args) -> None:
    """Train, save, and judge the agent beside the classical controllers."""
    import torch
    from rich.console import Console

    from drill_env import baselines
    from drill_env.agents.policy import describe, load, save_agent
    from drill_env.agents.progress import TrainingProgress
    from drill_env.benchmark import compare
    from drill_env.environment.config import EnvConfig
    from drill_env.report.compare_table import compare_table

    # Networks this small lose more than they gain on several threads.
    torch.set_num_threads(1)
    console = Console(stderr=True)
    env, config = make_env(args)
    model = make_model(args, env)
    left = args.total_steps - model.num_timesteps
    if left <= 0:
        console.print(f"already trained for {model.num_timesteps} steps")
    else:
        watch = TrainingProgress(args.total_steps, args.out, args.checkpoint_steps, console)
        try:
            model.learn(left, callback=watch, reset_num_timesteps=not args.resume)
        except KeyboardInterrupt:
            watch.stop()
            console.print(f"stopped after {model.num_timesteps} steps; go on with --resume")
            sys.exit(130)
    save_agent(model, config, args.out, {"trained_steps": model.num_timesteps, **describe(args)})
    table = compare({**baselines.CONTROLLERS, "ppo": lambda _: load(args.out)}, EnvConfig())
    table.to_csv(args.out / "compare.csv", index=False)
    Console(width=None if sys.stdout.isatty() else 120).print(compare_table(table))


if __name__ == "__main__":
    try:
        main(parse(sys.argv[1:]))
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
