"""The database behind the command line: its tables and its API keys."""

from __future__ import annotations

import time
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import structlog
import typer
from pydantic import ValidationError
from sqlalchemy.exc import SQLAlchemyError

from api.base.api_keys import SCOPES, KeyRecord, digest_of, new_key
from api.base.logs import configure_logs
from api.base.settings import Settings, faults_of
from api.store.database import database_url, make_engine
from api.store.keys import add_key, all_keys, revoke_key
from api.store.migrate import DatabaseTooNew, is_current, upgrade
from cli.work.terminal import plain_table, terminal

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from sqlalchemy import Engine

UPGRADE = "planner db upgrade"
"""The command that brings the tables up to date; the service does it, too, when it starts."""

COLUMNS = ("name", "id", "scopes", "a minute", "at once", "a day", "created", "revoked")
"""The columns of the list of keys."""


def upgrade_tables() -> None:
    """Bring the tables to the version of the service; see `planner db upgrade`."""
    with _connected() as engine:
        upgrade(engine)
    typer.echo("the tables are those of this version")


def check_tables() -> None:
    """Check the version of the tables; see `planner db check`."""
    with _connected() as engine:
        current = is_current(engine)
    if not current:
        typer.echo(f"the tables are not those of this version; see {UPGRADE}", err=True)
        raise typer.Exit(1)
    typer.echo("the tables are those of this version")


def create_key(name: str, scopes: Collection[str], limits: tuple[int | None, int | None], a_day: int | None) -> None:
    """Make a key and show it; see `planner keys create`."""
    if set(scopes) - set(SCOPES):
        raise typer.BadParameter(f"must be one of {', '.join(SCOPES)}", param_hint="--scope")
    chosen = frozenset(known for known in SCOPES if known in scopes)
    key_id, key = new_key()
    record = KeyRecord(key_id, name, digest_of(key), chosen, *limits, time.time(), None, a_day)
    with _connected() as engine:
        upgrade(engine)
        with engine.begin() as connection:
            add_key(connection, record)
    _audit("key_created", key_id)
    typer.echo(key)
    typer.echo(f"this is shown once; its id is {key_id}", err=True)


def list_keys() -> None:
    """List all keys; see `planner keys list`."""
    with _connected() as engine:
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


def revoke_key_of(key_id: str) -> None:
    """Revoke a key; see `planner keys revoke`."""
    with _connected() as engine:
        upgrade(engine)
        with engine.begin() as connection:
            was_valid = revoke_key(connection, key_id)
    if not was_valid:
        typer.echo(f"no valid key has the id {key_id}", err=True)
        raise typer.Exit(1)
    _audit("key_revoked", key_id)
    typer.echo(f"{key_id} is revoked")


@contextmanager
def _connected() -> Iterator[Engine]:
    """Connect to the database that the environment names, and show an error in one line."""
    try:
        url = database_url(Settings(access="open"))  # who may use the service is of no importance here
    except ValidationError as error:
        raise typer.BadParameter(faults_of(error)[0], param_hint="environment") from None
    if url is None:
        raise typer.BadParameter("set PLANNER_DATA_DIRECTORY or PLANNER_DATABASE_URL", param_hint="environment")
    engine = make_engine(url)
    try:
        yield engine
    except (DatabaseTooNew, SQLAlchemyError) as error:
        typer.echo(str(error).splitlines()[0], err=True)
        raise typer.Exit(1) from None
    finally:
        engine.dispose()


def _audit(action: str, key_id: str) -> None:
    """Log a change, as the service logs the changes of its clients."""
    configure_logs("info")
    structlog.get_logger().info("audit", action=action, subject=key_id, client="command line")


def _date(seconds: float | None) -> str:
    return "-" if seconds is None else datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d")
