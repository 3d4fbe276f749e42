"""A short film of each controller as it ends stick-slip, as animated GIF.

python benchmarks/controller_videos.py --names open-loop,lqi,encoders-ppo --out out/videos
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from PIL import Image

from drill_env import agents, baselines
from drill_env.environment import DrillStringEnv
from drill_env.environment.config import EnvConfig

EVERY = 2


def film(name: str, setpoint: float, seconds: float, path: Path) -> None:
    shipped = name in agents.names()
    made = agents.load(name) if shipped else baselines.make(name, EnvConfig())
    env = DrillStringEnv(
        "rgb_array", observation=made.view, history=made.history, start="limit_cycle",
        setpoint=setpoint, episode_seconds=seconds,
    )  # fmt: skip
    observation, _ = env.reset(seed=0)
    made.reset(1)
    frames, period = [], env.config.control_period
    for step in range(env.config.episode_steps):
        volts = made.act(np.asarray(observation, dtype=float)[None])
        observation, *_ = env.step(volts)
        if step % EVERY == 0:
            picture = Image.fromarray(np.asarray(env.render()))
            frames.append(picture.convert("P", palette=Image.Palette.ADAPTIVE, colors=64))
    env.close()
    pause = round(1000 * EVERY * period)
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=pause, loop=0)


def main(
    names: Annotated[str, typer.Option(help="Controllers and shipped agents.")] = "all",
    setpoint: Annotated[float, typer.Option(help="rad/s.")] = 3.0,
    seconds: Annotated[float, typer.Option(help="Length, s.")] = 12.0,
    out: Annotated[Path, typer.Option(help="Folder.")] = Path("out/videos"),
) -> None:
    out.mkdir(parents=True, exist_ok=True)
    everyone = [*agents.names(), *baselines.CONTROLLERS]
    for name in everyone if names == "all" else names.split(","):
        film(name, setpoint, seconds, out / f"{name}.gif")
        print(out / f"{name}.gif", flush=True)


if __name__ == "__main__":
    typer.run(main)
