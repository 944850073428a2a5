"""`farfield keys`: API keys of a store, for whoever has the store at hand."""

from __future__ import annotations

import click
from farfield_api.keys import SCOPES, Keys, KeyScope, hash_of
from farfield_core.store import Store

from farfield.options import store_option


@click.group("keys")
def command() -> None:
    """Make, list and end the API keys of a store."""


@command.command("new")
@click.argument("name")
@click.option("--scope", type=click.Choice(SCOPES), default="write", show_default=True)
@store_option
def new(name: str, scope: KeyScope, store: str) -> None:
    """Make a key and print it; only its hash is kept."""
    key, secret = Keys(Store.open(store)).create(name, scope)
    click.echo(f"{key.id}  {key.name}  {key.scope}", err=True)
    click.echo(secret)


@command.command("list")
@store_option
def list_(store: str) -> None:
    """List the keys of a store."""
    for key in Keys(Store.open(store, create=False)).list():
        until = f"  until {key.expires:%Y-%m-%d %H:%M}" if key.expires else ""
        click.echo(f"{key.id}  {key.scope:5}  {key.name}{until}")


@command.command("revoke")
@click.argument("identity", metavar="ID")
@store_option
def revoke(identity: str, store: str) -> None:
    """End a key at once."""
    Keys(Store.open(store, create=False)).revoke(identity)


@command.command("hash")
@click.argument("name")
@click.option("--scope", type=click.Choice(SCOPES), default="write", show_default=True)
def hash_(name: str, scope: str) -> None:
    """Read a key and print the entry of FARFIELD_API_KEYS that lets it in."""
    secret = click.prompt("Key", hide_input=True, err=True)
    click.echo(f"{name}:{scope}:{hash_of(secret)}")
