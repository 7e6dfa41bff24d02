"""Packages that neither the server process nor workers load; libraries import them for purposes of others."""

from __future__ import annotations

import sys

LEFT_OUT = ("rich", "pygments", "pydantic.v1", "twisted")
"""structlog imports rich and twisted, mako (of alembic) pygments, and FastAPI the models of pydantic 1. Each works
without. They would take 9 MB of the server's memory."""


def leave_out() -> None:
    """Let each import of these packages fail that comes after this, as if they were not installed."""
    for name in LEFT_OUT:
        sys.modules.setdefault(name, None)  # type: ignore[arg-type] # documented: importing the name raises
