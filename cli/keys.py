"""The command line of API keys: `planner keys`."""

from __future__ import annotations

from typing import Annotated

import typer

from api.base.api_keys import SCOPES, Scope

app = typer.Typer(
    name="keys",
    help="API keys, in the database that PLANNER_DATA_DIRECTORY or PLANNER_DATABASE_URL names.",
    no_args_is_help=True,
)

DEFAULT_SCOPES: list[Scope] = ["plan", "robots:write", "scenes:write", "projects:write", "batches"]
"""The scopes of a key without `--scope`: everything but the entries of others."""


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
    from cli.work.stored import create_key

    create_key(name, scope or DEFAULT_SCOPES, (requests_per_minute, concurrent_requests), requests_per_day)


@app.command("list")
def list_() -> None:
    """List all keys, without their text."""
    from cli.work.stored import list_keys

    list_keys()


@app.command()
def revoke(
    key_id: Annotated[str, typer.Argument(metavar="ID", help="The id of the key, as `planner keys list` has it.")],
) -> None:
    """Revoke a key: services refuse it within a second. Its robots and batches stay."""
    from cli.work.stored import revoke_key_of

    revoke_key_of(key_id)
