"""The robots that clients add: contents by their digest, and ids that stand for contents."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Literal, NamedTuple

from sqlalchemy import delete, exists, func, insert, or_, select, true

from api.database.batches import forget_contents
from api.database.locks import ROBOTS, exclusively
from api.database.tables import robot_contents, robots
from api.robot_content import RobotContent, with_id

if TYPE_CHECKING:
    from sqlalchemy import ColumnElement, Connection


class RobotBounds(NamedTuple):
    """How much is kept.

    Attributes:
        ids: The most ids.
        ids_of_owner: The most ids of one client.
        size: The most bytes of contents.
        size_of_owner: The most bytes of the contents that the ids of one client stand for.
    """

    ids: int
    ids_of_owner: int
    size: int
    size_of_owner: int


FOR_ALL = ""
"""The namespace of the robots that all clients see; each key has its own before it."""


def find_robot(connection: Connection, namespace: str, robot_id: str) -> RobotContent | None:
    """Find what an id stands for in a namespace, or else for all."""
    columns = (robot_contents.c[name] for name in ("digest", "definition", "description", "summary"))
    named = (robots.c.id == robot_id) & robots.c.namespace.in_([namespace, FOR_ALL])
    query = select(*columns).join(robots).where(named).order_by(robots.c.namespace.desc()).limit(1)
    found = connection.execute(query).one_or_none()
    return None if found is None else RobotContent(*found)


def add_robot(
    connection: Connection, namespace: str, robot_id: str, content: RobotContent, owner: str, bounds: RobotBounds
) -> Literal["added", "same", "exists", "full", "too_many"]:
    """Let an id stand for a content in a namespace, in the name of a client.

    Returns:
        `same`: it does already; `exists`: it stands for another; `full`: there is no room; `too_many`: the client
        has as many ids, or bytes, as one may have.
    """
    exclusively(connection, ROBOTS)
    named = (robots.c.namespace == namespace) & (robots.c.id == robot_id)
    kept = connection.scalar(select(robots.c.digest).where(named))
    if kept is not None:
        return "same" if kept == content.digest else "exists"
    ids = select(func.count()).select_from(robots)
    own_ids = connection.execute(ids.where(robots.c.owner == owner)).scalar_one()
    others = robot_contents.c.digest.in_(
        select(robots.c.digest).where(robots.c.owner == owner, robots.c.digest != content.digest)
    )
    if own_ids >= bounds.ids_of_owner or _size(connection, others) + content.size > bounds.size_of_owner:
        return "too_many"
    is_known = connection.scalar(select(exists().where(robot_contents.c.digest == content.digest)))
    more = 0 if is_known else content.size
    if _size(connection, true()) + more > bounds.size or connection.execute(ids).scalar_one() >= bounds.ids:
        return "full"
    if not is_known:
        connection.execute(insert(robot_contents).values(**vars(content), size=content.size))
    values = {"namespace": namespace, "id": robot_id, "digest": content.digest, "owner": owner, "added": time.time()}
    connection.execute(insert(robots).values(values))
    return "added"


def _size(connection: Connection, which: ColumnElement[bool]) -> int:
    """Add up the bytes of some of the contents."""
    size: int = connection.execute(select(func.coalesce(func.sum(robot_contents.c.size), 0)).where(which)).scalar_one()
    return size


def delete_robot(
    connection: Connection, namespace: str, robot_id: str, owner: str | None
) -> Literal["deleted", "unknown", "of_another"]:
    """Forget an id of a namespace, or else of all, and the content that nothing else needs.

    Args:
        connection: The transaction.
        namespace: Where the id is looked up first.
        robot_id: The id.
        owner: The client that must have added it; None: anybody may have.
    """
    exclusively(connection, ROBOTS)
    named = (robots.c.id == robot_id) & robots.c.namespace.in_([namespace, FOR_ALL])
    kept = connection.execute(select(robots).where(named).order_by(robots.c.namespace.desc()).limit(1)).one_or_none()
    if kept is None:
        return "unknown"
    if owner is not None and kept.owner != owner:
        return "of_another"
    connection.execute(delete(robots).where(robots.c.namespace == kept.namespace, robots.c.id == robot_id))
    forget_contents(connection, [kept.digest])
    return "deleted"


def robots_behind(connection: Connection, namespace: str, robot_id: str, limit: int) -> list[tuple[str, bytes]]:
    """List ids that come after one, in their order by code point, each with its entry of GET /v1/robots.

    They are those of a namespace and those of all, but for ids that stand for another robot in the namespace.
    """
    order = robots.c.id.collate("C") if connection.dialect.name == "postgresql" else robots.c.id
    own = robots.alias()
    is_hidden = select(own.c.id).where(own.c.namespace == namespace, own.c.id == robots.c.id).exists()
    is_seen = or_(robots.c.namespace == namespace, (robots.c.namespace == FOR_ALL) & ~is_hidden)
    query = select(robots.c.id, robot_contents.c.summary).join(robot_contents).where(is_seen)
    rows = connection.execute(query.where(order > robot_id).order_by(order).limit(limit))
    return [(row.id, with_id(row.id, row.summary)) for row in rows]
