"""`farfield COMMAND ...`: the command line, one module a command."""

from __future__ import annotations

import importlib
import signal
import sys
from types import FrameType

import click
from farfield_core import __version__
from farfield_core.errors import FarfieldError

#: command -> first line of help; its module in farfield.commands is imported only when asked for
COMMANDS = {
    "layers": "Where layers and borders lie.",
    "plan": "What a bake will come to; renders nothing.",
    "bake": "Bake a corridor through a scene.",
    "verify": "How good a walk is, against full renders.",
    "shoot": "One picture of a scene or a walk.",
    "serve": "Serve the API, the pages and baking.",
    "demo": "Bake a corridor and open the walk while it bakes.",
    "worker": "Bake cells for a farm.",
    "export": "Write a walk as a static folder or as one zip.",
    "upload": "Send a model to a server.",
    "bakes": "List the bakes of a server.",
    "watch": "Follow a bake of a server.",
    "keys": "Make, list and end the API keys of a store.",
    "bake-object": "Bake one model as an object impostor.",
}


class Commands(click.Group):
    """Imports a command when it is used, so that `farfield layers` answers at once."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands, in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name."""
        if cmd_name not in COMMANDS:
            return None
        command = importlib.import_module(f"farfield.commands.{cmd_name.replace('-', '_')}").command
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of commands, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.command(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="farfield")
def cli() -> None:
    """Walk through enormous static 3D models in a plain browser."""


def _terminated(signum: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def main(arguments: list[str] | None = None) -> int:
    """Run a command line; returns the exit code."""
    # whoever stops us, children and half-written files are seen to
    signal.signal(signal.SIGTERM, _terminated)
    try:
        cli.main(arguments, prog_name="farfield", standalone_mode=False)
    except click.exceptions.Exit as error:
        return error.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except FarfieldError as error:
        click.echo(str(error), err=True)
        return error.exit_code
    except (KeyboardInterrupt, click.exceptions.Abort):
        click.echo("Stopped.", err=True)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
