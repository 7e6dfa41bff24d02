"""Packages that the server process does not load; libraries import them for consoles and old models, 9 MB of memory."""

from __future__ import annotations

import sys

LEFT_OUT = ("rich", "pygments", "pydantic.v1")
"""structlog imports rich, mako (of alembic) pygments, and FastAPI the models of pydantic 1. Each works without."""


def leave_out() -> None:
    """Let each import of these packages fail that comes after this, as if they were not installed."""
    for name in LEFT_OUT:
        sys.modules.setdefault(name, None)  # type: ignore[arg-type] # documented: importing the name raises
