"""API keys in the database, which has their digests only."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from sqlalchemy import delete, insert, select, update

from api.base.api_keys import SCOPES, KeyRecord
from api.store.locks import USAGE, exclusively
from api.store.tables import keys, usage

if TYPE_CHECKING:
    from typing import Any

    from sqlalchemy import Connection


def add_key(connection: Connection, record: KeyRecord) -> None:
    """Keep a new key."""
    connection.execute(insert(keys).values({**record._asdict(), "scopes": " ".join(sorted(record.scopes))}))


def find_key(connection: Connection, key_id: str) -> KeyRecord | None:
    """Find the record of a key."""
    row = connection.execute(select(keys).where(keys.c.id == key_id)).one_or_none()
    return None if row is None else _record(row)


def all_keys(connection: Connection) -> list[KeyRecord]:
    """List all keys, in the order in which they were made, the revoked ones among them."""
    return [_record(row) for row in connection.execute(select(keys).order_by(keys.c.created, keys.c.id))]


def revoke_key(connection: Connection, key_id: str) -> bool:
    """Revoke a key; tell whether there is one with this id that was valid."""
    valid = (keys.c.id == key_id) & keys.c.revoked.is_(None)
    return bool(connection.execute(update(keys).where(valid).values(revoked=time.time())).rowcount)


def count_requests(connection: Connection, key_id: str, day: int, count: int) -> int:
    """Add to the requests that a key has sent on a day, and give their number; days before are forgotten."""
    exclusively(connection, USAGE)
    connection.execute(delete(usage).where(usage.c.key == key_id, usage.c.day < day))
    of_day = (usage.c.key == key_id) & (usage.c.day == day)
    kept = connection.scalar(select(usage.c.requests).where(of_day))
    if kept is None:
        connection.execute(insert(usage).values(key=key_id, day=day, requests=count))
    elif count:
        connection.execute(update(usage).where(of_day).values(requests=kept + count))
    return (kept or 0) + count


def _record(row: Any) -> KeyRecord:
    """Read a row; a scope that this version does not know grants nothing."""
    return KeyRecord(**{**row._asdict(), "scopes": frozenset(row.scopes.split()) & frozenset(SCOPES)})
