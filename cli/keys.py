"""The command line of API keys: `planner keys`."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from typing import Annotated

import typer

from api.base.api_keys import SCOPES, Scope
from cli.database import connected

app = typer.Typer(
    name="keys",
    help="API keys, in the database that PLANNER_DATA_DIRECTORY or PLANNER_DATABASE_URL names.",
    no_args_is_help=True,
)

DEFAULT_SCOPES: list[Scope] = ["plan", "robots:write", "scenes:write", "batches"]
"""The scopes of a key without `--scope`: everything but the entries of others."""

COLUMNS = ("name", "id", "scopes", "a minute", "at once", "a day", "created", "revoked")
"""The columns of the list of keys."""


@app.command()
def create(
    name: Annotated[str, typer.Argument(metavar="NAME", help="What the holder of the key is called.")],
    scope: Annotated[
        list[str] | None,
        typer.Option(
            "--scope",
            metavar="SCOPE",
            help=f"What it may do; may be given several times: {', '.join(SCOPES)}.",
            show_default=", ".join(DEFAULT_SCOPES),
        ),
    ] = None,
    requests_per_minute: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Most requests in a minute.", show_default="by the service")
    ] = None,
    concurrent_requests: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Most requests under way.", show_default="by the service")
    ] = None,
    requests_per_day: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Most requests in a day, with batches'.", show_default="by the service"),
    ] = None,
) -> None:
    """Make a key and show it, once: only its hash is kept."""
    from api.base.api_keys import KeyRecord, digest_of, new_key
    from api.store.keys import add_key
    from api.store.migrate import upgrade

    asked = set(scope or DEFAULT_SCOPES)
    if asked - set(SCOPES):
        raise typer.BadParameter(f"there are the scopes {', '.join(SCOPES)}", param_hint="--scope")
    chosen = frozenset(known for known in SCOPES if known in asked)
    key_id, key = new_key()
    limits = (requests_per_minute, concurrent_requests)
    record = KeyRecord(key_id, name, digest_of(key), chosen, *limits, time.time(), None, requests_per_day)
    with connected() as engine:
        upgrade(engine)
        with engine.begin() as connection:
            add_key(connection, record)
    _audit("key_created", key_id)
    typer.echo(key)
    typer.echo(f"this is shown once; its id is {key_id}", err=True)


@app.command("list")
def list_() -> None:
    """List all keys, without their text."""
    from api.store.keys import all_keys
    from api.store.migrate import upgrade
    from cli.terminal import plain_table, terminal

    with connected() as engine:
        upgrade(engine)
        with engine.execution_options(reads=True).connect() as connection:
            found = all_keys(connection)
    table = plain_table(*COLUMNS)
    table.columns[COLUMNS.index("scopes")].no_wrap = False  # so that there is room for the names
    for key in found:
        granted = (key.requests_per_minute, key.concurrent_requests, key.requests_per_day)
        limits = ("-" if limit is None else str(limit) for limit in granted)
        table.add_row(key.name, key.id, " ".join(sorted(key.scopes)), *limits, _date(key.created), _date(key.revoked))
    terminal().print(table)


@app.command()
def revoke(
    key_id: Annotated[str, typer.Argument(metavar="ID", help="The id of the key, as `planner keys list` has it.")],
) -> None:
    """Revoke a key: services refuse it within a second. Its robots and batches stay."""
    from api.store.keys import revoke_key
    from api.store.migrate import upgrade

    with connected() as engine:
        upgrade(engine)
        with engine.begin() as connection:
            was_valid = revoke_key(connection, key_id)
    if not was_valid:
        typer.echo(f"no valid key has the id {key_id}", err=True)
        raise typer.Exit(1)
    _audit("key_revoked", key_id)
    typer.echo(f"{key_id} is revoked")


def _audit(action: str, key_id: str) -> None:
    """Log a change, as the service logs the changes of its clients."""
    import structlog

    from api.base.logs import configure_logs

    configure_logs("info")
    structlog.get_logger().info("audit", action=action, subject=key_id, client="command line")


def _date(seconds: float | None) -> str:
    return "-" if seconds is None else datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d")
