"""Locks by which services that share a database keep out of each other's way."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sqlalchemy import text

if TYPE_CHECKING:
    from sqlalchemy import Connection

MIGRATIONS = 7_390_001
"""The number of the advisory lock under which tables are changed; other programs in the same database use others."""

CONTENTS = 7_390_002
"""The number of the advisory lock under which robots, scenes and projects are added, changed and deleted."""

BATCHES = 7_390_003
"""The number of the advisory lock under which batches arrive."""


USAGE = 7_390_004
"""The number of the advisory lock under which requests of keys are counted."""


def exclusively(connection: Connection, lock: int) -> None:
    """Keep others from the same work until the transaction ends; whoever writes to SQLite does so anyway."""
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": lock})
