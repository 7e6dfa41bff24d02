"""The command `planner mcp`."""

from __future__ import annotations

import os
import tempfile
from contextlib import ExitStack
from pathlib import Path

import anyio
import typer

from cli.local_service import local_service


def serve_agents(url: str | None, host: str, port: int | None) -> None:
    """Serve agents over stdio, or over HTTP on a port, with the tools of a service.

    Args:
        url: The base URL of the service; None: a service of its own.
        host: The address to listen on.
        port: The port to listen on; None: stdio.

    Raises:
        BadParameter: The package `mcp` is not installed.
    """
    try:
        from cli.agents.server import planner_server, serve_http, serve_stdio
    except ModuleNotFoundError as error:
        message = f"The package {error.name} is missing. Install it: pip install 'trajectory-planner[agents]'"
        raise typer.BadParameter(message, param_hint="mcp") from None
    with ExitStack() as stack:
        if url is None:
            folder = stack.enter_context(tempfile.TemporaryDirectory())
            url, _ = stack.enter_context(local_service(Path(folder) / "log.jsonl"))
        server = planner_server(url, os.environ.get("PLANNER_KEY"))
        if port is None:
            anyio.run(serve_stdio, server)
        else:
            serve_http(server, host, port)
