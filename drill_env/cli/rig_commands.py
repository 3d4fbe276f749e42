"""Commands about rig files."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import typer

from drill_env.cli._common import JsonOption, RigOption, print_json, rig_from
from drill_env.parameters import dump_rig

rig_app = typer.Typer(help="Rig files: check one, show it or the paper's.", no_args_is_help=True)


@rig_app.command("show")
def show(
    rig: RigOption = None,
    clamp: Annotated[
        bool, typer.Option("--clamp", help="Forbid negative friction, equation (3).")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Check a rig file and print it; the paper's rig by default.

    Redirect it to a file to start your own.

    Example: drill-env rig show > rig.toml
    """
    from drill_env.friction import negative_range

    found = rig_from(rig)
    if clamp:
        found = found.replace(clamp=True)
    if not as_json:
        typer.echo(dump_rig(found), nl=False)
        return
    print_json(
        {
            "rig": dataclasses.asdict(found),
            "breakaway_voltage_V": found.breakaway_voltage,
            "natural_period_s": found.natural_period,
            "negative_friction_rad_s": negative_range(found),
        }
    )
