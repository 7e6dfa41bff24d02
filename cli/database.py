"""The command line of the database: `planner db`."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Engine

app = typer.Typer(name="db", help="The database that PLANNER_DATA_DIRECTORY or PLANNER_DATABASE_URL names.")

UPGRADE = "planner db upgrade"
"""The command that brings the tables up to date; the service does it, too, when it starts."""


@app.command()
def upgrade() -> None:
    """Bring the tables to what this version of the service works with."""
    from api.store.migrate import upgrade

    with connected() as engine:
        upgrade(engine)
    typer.echo("the tables are those of this version")


@app.command()
def check() -> None:
    """Check the version of the tables; ends with 1 if this version of the service needs an upgrade."""
    from api.store.migrate import is_current

    with connected() as engine:
        current = is_current(engine)
    if not current:
        typer.echo(f"the tables are not those of this version; see {UPGRADE}", err=True)
        raise typer.Exit(1)
    typer.echo("the tables are those of this version")


@contextmanager
def connected() -> Iterator[Engine]:
    """Connect to the database that the environment names, and show an error in one line."""
    from pydantic import ValidationError
    from sqlalchemy.exc import SQLAlchemyError

    from api.base.settings import Settings, faults_of
    from api.store.database import database_url, make_engine
    from api.store.migrate import DatabaseTooNew

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
