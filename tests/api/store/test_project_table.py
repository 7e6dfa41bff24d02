"""The tables of projects, on SQLite and on PostgreSQL: one namespace never changes the projects of another."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import pytest
from sqlalchemy import func, select

from api.store.contents.projects import project_content
from api.store.named_contents import FOR_ALL, PROJECTS, Bounds
from api.store.tables import project_contents
from tests.api.store.databases import engine, postgres

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection, Engine

__all__ = ["engine", "postgres"]
A, B, C = (project_content(b'{"of":"%s"}' % name) for name in (b"a", b"b", b"c"))
WIDE = Bounds(ids=10, ids_of_owner=10, size=1000, size_of_owner=1000)


@pytest.fixture
def connection(engine: Engine) -> Iterator[Connection]:
    """A transaction that is undone; the project `cell` was saved before there were keys."""
    with engine.connect() as connection:
        PROJECTS.put(connection, FOR_ALL, "cell", A, "127.0.0.1", "127.0.0.1", WIDE)
        yield connection
        connection.rollback()


def test_a_key_saves_beside_a_common_project_of_the_same_name(connection: Connection) -> None:
    put = partial(PROJECTS.put, connection, "key:x", "cell", client="key:x", owner="key:x", bounds=WIDE)
    found = partial(PROJECTS.find, connection)
    assert found("key:x", "cell") == A
    assert put(A) == "same" and put(B, is_expected=lambda digest: digest is None) == "changed"
    assert put(B, is_expected=lambda digest: digest == A.digest) == "added"
    assert put(C) == "replaced" and (found("key:x", "cell"), found("key:y", "cell")) == (C, A)
    delete = partial(PROJECTS.delete, connection, "key:x", "cell", "key:x")
    assert delete(lambda digest: digest == A.digest) == "changed"
    assert delete() == "deleted" and delete() == "of_another" and found("key:x", "cell") == A
    assert connection.scalar(select(func.count()).select_from(project_contents)) == 1


def test_another_client_replaces_nothing_and_bounds_hold(connection: Connection) -> None:
    put = partial(PROJECTS.put, connection, FOR_ALL)
    assert put("cell", B, "127.0.0.2", "127.0.0.2", WIDE) == "of_another"
    assert put("cell", B, "127.0.0.2", None, WIDE) == "replaced"
    assert put("hall", A, "127.0.0.2", "127.0.0.2", WIDE._replace(ids=1)) == "full"
    assert put("hall", A, "127.0.0.1", "127.0.0.1", WIDE._replace(ids_of_owner=1)) == "too_many"
    assert put("hall", A, "127.0.0.1", "127.0.0.1", WIDE._replace(size=A.size + B.size - 1)) == "full"
    assert put("hall", A, "127.0.0.1", "127.0.0.1", WIDE._replace(size=A.size + B.size)) == "added"
