"""The command line: every command, and the exit status of each outcome."""

from __future__ import annotations

import errno
import io
import os
import sys
from typing import Annotated, Any

import typer

from drill_env import __version__, _compiling
from drill_env._ending import ending_tidily
from drill_env._errors import InputError, printable
from drill_env.cli import recording_commands
from drill_env.cli._common import SeveralHoldouts
from drill_env.cli.bifurcation_command import bifurcation_command
from drill_env.cli.check_command import check_command
from drill_env.cli.compare_command import compare_command
from drill_env.cli.demo_command import demo_command
from drill_env.cli.design_command import design_command
from drill_env.cli.diagnose_command import diagnose_command
from drill_env.cli.fleet_command import fleet_command
from drill_env.cli.rig_commands import rig_app
from drill_env.cli.signal_command import signal_command
from drill_env.cli.simulate_command import simulate_command

_INTERRUPTED = 130
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help=(
        "Torsional vibration of rotary drilling on the experimental drill-string rig.\n\n"
        "Start with [bold]drill-env demo[/bold]. Every command has --help; results as JSON with "
        "--json. Exit status: 0 done, 2 bad input, 1 a fault of ours, 130 interrupted."
    ),
)
app.command("demo")(demo_command)
app.add_typer(rig_app, name="rig")
app.command("bifurcation")(bifurcation_command)
app.command("simulate")(simulate_command)
app.command("signal")(signal_command)
app.command("check")(check_command)
recording_commands.register(app)
app.command("compare")(compare_command)
app.command("diagnose", cls=SeveralHoldouts)(diagnose_command)
app.command("fleet")(fleet_command)
app.command("design-experiment")(design_command)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"drill-env {__version__}")
        raise typer.Exit()


@app.callback()
def options(
    ctx: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Version.")
    ] = False,
) -> None:
    """Options of the whole program."""
    if not ctx.resilient_parsing:
        _compiling.observe(_compiling.Lines())


def obey() -> None:
    """Obey the command line: bad input is one line on stderr and exit status 2."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        # A path that is no UTF-8 is shown by its bytes.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        status = app(standalone_mode=False) or 0
        if status == _INTERRUPTED:
            # Typer keeps the interrupt itself.
            raise KeyboardInterrupt
        # A full disk shows here and not when the interpreter has gone.
        sys.stdout.flush()
        sys.exit(status)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(_INTERRUPTED)
    except BrokenPipeError:
        # The reader has had enough (`| head`): not an error, and nothing left to flush.
        sys.stderr.close()
        sys.exit(0)
    except OSError as error:
        if error.errno not in _FULL:
            raise
        print(f"error: cannot write the output: {error.strerror}; make room", file=sys.stderr)
        # What is left in the buffer cannot be written either.
        sys.stdout = open(os.devnull, "w", encoding="utf-8")
        sys.exit(2)
    except MemoryError as error:
        text = printable(error) or "the memory is full"
        print(f"error: {text}; give shorter recordings or fewer of them", file=sys.stderr)
        sys.exit(2)
    except Exception as error:
        # Known by its method: typer carries a copy of click whose classes are not public.
        if not hasattr(error, "format_message"):
            raise
        _print_usage_error(error)
        sys.exit(2)


def _print_usage_error(error: Any) -> None:
    if type(error).__name__ == "NoArgsIsHelpError":
        return
    command = error.ctx.command_path if getattr(error, "ctx", None) else "drill-env"
    text = printable(" ".join(error.format_message().split()).rstrip("."))
    print(f"error: {text}; see {command} --help", file=sys.stderr)


def run() -> None:
    """Entry point of the program, which ends after it."""
    with ending_tidily():
        obey()


if __name__ == "__main__":
    run()
