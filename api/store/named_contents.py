"""What clients leave under ids: contents, each kept once by its digest, and ids that stand for contents."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Literal, NamedTuple, TypeVar

from sqlalchemy import and_, delete, exists, func, insert, not_, or_, select, true, update

from api.store.contents.robots import RobotContent, with_id
from api.store.contents.scenes import SceneContent
from api.store.locks import CONTENTS, exclusively
from api.store.tables import items, robot_contents, robots, scene_contents, scenes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sqlalchemy import Column, ColumnElement, Connection, Row, Table

C = TypeVar("C", RobotContent, SceneContent)

FOR_ALL = ""
"""The namespace of the ids that all clients see; each key has its own before it."""


class Bounds(NamedTuple):
    """The bounds on contents of one kind.

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


@dataclass(frozen=True)
class NamedContents(Generic[C]):
    """Contents of one kind, and the ids that stand for them.

    Attributes:
        ids: The table of ids.
        contents: The table of contents, whose columns are the fields of a content, and its size.
        needed_by_item: The column by which items of batches need contents, whatever becomes of the ids.
        kind: The class of a content.
    """

    ids: Table
    contents: Table
    needed_by_item: Column[Any]
    kind: type[C]

    def find(self, connection: Connection, namespace: str, name: str) -> C | None:
        """Find what an id stands for in a namespace, or else for all."""
        columns = (column for column in self.contents.c if column.name != "size")
        query = select(*columns).join(self.ids).where(self._seen_as(namespace, name))
        found = connection.execute(query.order_by(self.ids.c.namespace.desc()).limit(1)).one_or_none()
        return None if found is None else self.kind(**found._mapping)

    def digests(self, connection: Connection, namespace: str, names: set[str | None]) -> dict[str, str]:
        """Find the digests of what ids stand for in a namespace, or else for all."""
        known = select(self.ids).where(self.ids.c.id.in_(names), self.ids.c.namespace.in_([namespace, FOR_ALL]))
        rows = connection.execute(known.order_by(self.ids.c.namespace))  # those of the namespace come last
        return {row.id: row.digest for row in rows}

    def add(
        self, connection: Connection, namespace: str, name: str, content: C, owner: str, bounds: Bounds
    ) -> Literal["added", "same", "exists", "full", "too_many"]:
        """Let an id stand for a content in a namespace, in the name of a client.

        Returns:
            `same`: it does already. `exists`: it stands for another. `full`: there is no room. `too_many`: the client
            has as many ids, or bytes, as one may have.
        """
        exclusively(connection, CONTENTS)
        named = self._named(namespace, name)
        kept = connection.scalar(select(self.ids.c.digest).where(named))
        if kept is not None:
            return "same" if kept == content.digest else "exists"
        lacking = self._lacking(connection, content, owner, bounds, named)
        if lacking is not None:
            return lacking
        self._keep(connection, content)
        values = {"namespace": namespace, "id": name, "digest": content.digest, "owner": owner, "added": time.time()}
        connection.execute(insert(self.ids).values(values))
        return "added"

    def replace(
        self,
        connection: Connection,
        namespace: str,
        name: str,
        before: str,
        content: C,
        owner: str | None,
        bounds: Bounds,
    ) -> Literal["replaced", "changed", "unknown", "of_another", "full", "too_many"]:
        """Let an id of a namespace, or else of all, stand for another content than before.

        Args:
            connection: The transaction.
            namespace: Where the id is looked up first.
            name: The id.
            before: The digest of the content that it has to stand for.
            content: The content of the id.
            owner: The client that must have added it; None: anybody may have.
            bounds: The bounds on contents of the kind.

        Returns:
            `changed`: it stands for something else than before by now; for the others see `add` and `delete`.
        """
        exclusively(connection, CONTENTS)
        kept = self.owned(connection, namespace, name, owner)
        if isinstance(kept, str):
            return kept
        if kept.digest != before:
            return "changed"
        named = self._named(kept.namespace, name)
        lacking = self._lacking(connection, content, kept.owner, bounds, named)
        if lacking is not None:
            return lacking
        self._keep(connection, content)
        connection.execute(update(self.ids).where(named).values(digest=content.digest))
        self.forget(connection, [before])
        return "replaced"

    def delete(
        self, connection: Connection, namespace: str, name: str, owner: str | None
    ) -> Literal["deleted", "unknown", "of_another"]:
        """Forget an id of a namespace, or else of all, and the content that nothing else needs.

        Args:
            connection: The transaction.
            namespace: Where the id is looked up first.
            name: The id.
            owner: The client that must have added it; None: anybody may have.
        """
        exclusively(connection, CONTENTS)
        kept = self.owned(connection, namespace, name, owner)
        if isinstance(kept, str):
            return kept
        connection.execute(delete(self.ids).where(self._named(kept.namespace, name)))
        self.forget(connection, [kept.digest])
        return "deleted"

    def behind(self, connection: Connection, namespace: str, name: str, limit: int) -> list[tuple[str, bytes]]:
        """List ids after one, by code point, each with its entry in the list of all.

        They are ids of a namespace and common ids, except for common ids with another meaning in the namespace.
        """
        ids = self.ids
        order = ids.c.id.collate("C") if connection.dialect.name == "postgresql" else ids.c.id
        own = ids.alias()
        is_hidden = select(own.c.id).where(own.c.namespace == namespace, own.c.id == ids.c.id).exists()
        is_seen = or_(ids.c.namespace == namespace, (ids.c.namespace == FOR_ALL) & ~is_hidden)
        query = select(ids.c.id, self.contents.c.summary).join(self.contents).where(is_seen)
        rows = connection.execute(query.where(order > name).order_by(order).limit(limit))
        return [(row.id, with_id(row.id, row.summary)) for row in rows]

    def owned(
        self, connection: Connection, namespace: str, name: str, owner: str | None
    ) -> Row[Any] | Literal["unknown", "of_another"]:
        """Find the row of an id that a client may change, or why there is none."""
        query = select(self.ids).where(self._seen_as(namespace, name)).order_by(self.ids.c.namespace.desc())
        kept = connection.execute(query.limit(1)).one_or_none()
        if kept is None:
            return "unknown"
        return kept if owner is None or kept.owner == owner else "of_another"

    def forget(self, connection: Connection, digests: Sequence[str | None]) -> None:
        """Delete contents for which no id stands, and which no batch needs."""
        unneeded = not_(self._is_needed(true()))
        connection.execute(delete(self.contents).where(self.contents.c.digest.in_(digests), unneeded))

    def _named(self, namespace: str, name: str) -> ColumnElement[bool]:
        return and_(self.ids.c.namespace == namespace, self.ids.c.id == name)

    def _seen_as(self, namespace: str, name: str) -> ColumnElement[bool]:
        return and_(self.ids.c.id == name, self.ids.c.namespace.in_([namespace, FOR_ALL]))

    def _lacking(
        self, connection: Connection, content: C, owner: str, bounds: Bounds, named: ColumnElement[bool]
    ) -> Literal["full", "too_many"] | None:
        """Tell whether there is no room for an id that stands for a content, besides all other ids."""
        others = self.ids.c.owner == owner, not_(named)
        own_ids = connection.execute(select(func.count()).where(*others)).scalar_one()
        own = self.contents.c.digest.in_(select(self.ids.c.digest).where(*others, self.ids.c.digest != content.digest))
        if own_ids >= bounds.ids_of_owner or self._size(connection, own) + content.size > bounds.size_of_owner:
            return "too_many"
        digest = self.contents.c.digest
        replaced = digest.in_(select(self.ids.c.digest).where(named))
        besides = self._size(connection, digest != content.digest, or_(not_(replaced), self._is_needed(not_(named))))
        ids = connection.execute(select(func.count()).select_from(self.ids).where(not_(named))).scalar_one()
        return "full" if besides + content.size > bounds.size or ids >= bounds.ids else None

    def _keep(self, connection: Connection, content: C) -> None:
        if not self._is_kept(connection, content):
            connection.execute(insert(self.contents).values(**vars(content), size=content.size))

    def _is_kept(self, connection: Connection, content: C) -> bool:
        return bool(connection.scalar(select(exists().where(self.contents.c.digest == content.digest))))

    def _is_needed(self, by: ColumnElement[bool]) -> ColumnElement[bool]:
        """Tell whether one of some ids stands for a content, or a batch needs it."""
        digest = self.contents.c.digest
        by_id = select(self.ids.c.id).where(self.ids.c.digest == digest, by).exists()
        return or_(by_id, select(items.c.batch).where(self.needed_by_item == digest).exists())

    def _size(self, connection: Connection, *which: ColumnElement[bool]) -> int:
        """Add up the bytes of some of the contents."""
        total = select(func.coalesce(func.sum(self.contents.c.size), 0)).where(*which)
        size: int = connection.execute(total).scalar_one()
        return size


ROBOTS = NamedContents(robots, robot_contents, items.c.robot, RobotContent)
"""The robots that clients add."""

SCENES = NamedContents(scenes, scene_contents, items.c.scene, SceneContent)
"""The scenes that clients add."""
