"""The command line of the database: `planner db`."""

from __future__ import annotations

import typer

app = typer.Typer(name="db", help="The database that PLANNER_DATA_DIRECTORY or PLANNER_DATABASE_URL names.")


@app.command()
def upgrade() -> None:
    """Bring the tables to the version of the service."""
    from cli.work.stored import upgrade_tables

    upgrade_tables()


@app.command()
def check() -> None:
    """Check the version of the tables; ends with 1 if this version of the service needs an upgrade."""
    from cli.work.stored import check_tables

    check_tables()
