"""Options that commands share; those of a bake's settings are made from BakeSettings itself."""

from __future__ import annotations

import contextlib
import functools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import click
from farfield_core.errors import BadInputError
from farfield_core.settings import BakeSettings
from farfield_core.validation import parse
from pydantic.fields import FieldInfo

Function = Callable[..., Any]

json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON object as the last line."
)
corridor_option = click.option(
    "--corridor",
    type=click.Path(path_type=Path),
    required=True,
    help="Corridor file: a box or a path.",
)
jobs_option = click.option(
    "--jobs",
    type=click.IntRange(1, 1024),
    envvar="FARFIELD_JOBS",
    help="Number of processes; as many as there are cores unless given.",
)
store_option = click.option(
    "--store",
    envvar="FARFIELD_STORE",
    default="./farfield-store",
    show_default=True,
    help="Folder or s3://bucket/prefix with scenes and bakes.",
)


def server_options(function: Function) -> Function:
    """Which server to speak to."""
    server = click.option(
        "--server",
        envvar="FARFIELD_SERVER",
        default="http://127.0.0.1:8000",
        show_default=True,
        help="Root of a Farfield server.",
    )
    key = click.option(
        "--key", envvar="FARFIELD_KEY", default="", help="API key, where the server asks for one."
    )
    return server(key(function))


def port_options(function: Function) -> Function:
    """Where a server listens."""
    host = click.option(
        "--host",
        envvar="FARFIELD_HOST",
        default="127.0.0.1",
        show_default=True,
        help="Address to listen on.",
    )
    port = click.option(
        "--port",
        type=click.IntRange(0, 65535),
        envvar="FARFIELD_PORT",
        default=8000,
        show_default=True,
        help="Port to listen on; 0 takes a free one.",
    )
    return host(port(function))


def option_name(field: str) -> str:
    """Option of a settings field: `cell_size` -> `--cell-size`."""
    return "--" + field.replace("_", "-")


def settings_options(*names: str) -> Callable[[Function], Function]:
    """Options for the settings `names` (all unless given), passed on as `settings`.

    An option wins over its environment variable, FARFIELD_<NAME>; what is not given is left to
    BakeSettings, which also judges the values.
    """
    chosen = names or tuple(BakeSettings.model_fields)

    def decorate(function: Function) -> Function:
        @functools.wraps(function)
        def with_settings(**given: Any) -> Any:
            values = {name: given.pop(name) for name in chosen}
            return function(settings=read_settings(values), **given)

        command: Function = with_settings
        for name in reversed(chosen):
            field = BakeSettings.model_fields[name]
            command = click.option(
                option_name(name),
                name,
                envvar=f"FARFIELD_{name.upper()}",
                metavar=_metavar(name, field),
                help=f"{_sentence(field.description or '')}  [default: {_shown(field.default)}]",
            )(command)
        return command

    return decorate


def read_settings(given: dict[str, str | None]) -> BakeSettings:
    """Settings from option texts, None where one was not given; raises BadInputError."""
    values = {name: _value(name, text) for name, text in given.items() if text is not None}
    return parse(BakeSettings, values, "The settings")


def _value(name: str, text: str) -> object:
    if text.strip().lower() == "none":
        return None
    if name == "cell_size":
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            raise BadInputError(
                f"--cell-size {text} cannot be read; give one number or three, as in 14,4,14."
            ) from None
        return numbers[0] if len(numbers) == 1 else numbers
    if name == "budget":
        return _budget(text)
    return _number(text)


def _number(text: str) -> int | float | str:
    """The number that `text` writes, else `text` itself."""
    for kind in (int, float):
        with contextlib.suppress(ValueError):
            return kind(text)
    return text


def _budget(text: str) -> dict[str, int | float | str]:
    """`triangles=N,megabytes=M` as an object; BakeSettings judges names and numbers."""
    parts = [part.partition("=") for part in text.split(",")]
    if not all(name.strip() and sign and value.strip() for name, sign, value in parts):
        raise BadInputError(
            f"--budget {text} cannot be read; give it as in triangles=20000,megabytes=1."
        )
    return {name.strip(): _number(value) for name, _, value in parts}


def _metavar(name: str, field: FieldInfo) -> str:
    if name == "cell_size":
        return "S|X,Y,Z"
    if name == "budget":
        return "triangles=N,megabytes=M"
    if get_origin(field.annotation) is Literal:
        return "|".join(get_args(field.annotation))
    kinds = get_args(field.annotation)
    if type(None) in kinds:
        return "NUMBER|none"
    return "N" if field.annotation is int else "NUMBER"


def _shown(default: object) -> str:
    if default is None:
        return "none"
    if isinstance(default, tuple):
        return ",".join(f"{n:g}" for n in default)
    return f"{default:g}" if isinstance(default, float) else str(default)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + "."


def print_json(value: dict[str, Any]) -> None:
    """Print one JSON object as a line of its own on standard output."""
    click.echo(json.dumps(value))
