"""What clients leave under ids: contents, each kept once by its digest, and ids that stand for contents."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Literal, NamedTuple, TypeVar

from sqlalchemy import and_, delete, exists, false, func, insert, not_, or_, select, true, update

from api.store.contents.projects import ProjectContent, project_entry
from api.store.contents.robots import RobotContent, with_id
from api.store.contents.scenes import SceneContent
from api.store.locks import CONTENTS, exclusively
from api.store.tables import items, project_contents, projects, robot_contents, robots, scene_contents, scenes

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sqlalchemy import Column, ColumnElement, Connection, Row, Table

C = TypeVar("C", RobotContent, SceneContent, ProjectContent)

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


def _entry(name: str, summary: bytes, _added: float) -> bytes:
    return with_id(name, summary)


def _whatever(_digest: str | None) -> bool:
    return True


@dataclass(frozen=True)
class NamedContents(Generic[C]):
    """Contents of one kind, and the ids that stand for them.

    Attributes:
        ids: The table of ids.
        contents: The table of contents, whose columns are the fields of a content, and its size.
        needed_by_item: The column by which items of batches need contents, whatever becomes of the ids; None: they need
            none.
        kind: The class of a content.
        entry: Writes the entry in the list of all as JSON. Its arguments are an id, the summary of its content, and the
            time at which the id was added or last changed (s since 1970).
    """

    ids: Table
    contents: Table
    needed_by_item: Column[Any] | None
    kind: type[C]
    entry: Callable[[str, bytes, float], bytes] = _entry

    def find(self, connection: Connection, namespace: str, name: str) -> C | None:
        """Find what an id stands for in a namespace, or else for all; a robot without its visual meshes."""
        columns = (column for column in self.contents.c if column.name not in {"size", "visuals"})
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
        connection.execute(update(self.ids).where(named).values(digest=content.digest, added=time.time()))
        self.forget(connection, [before])
        return "replaced"

    def put(
        self,
        connection: Connection,
        namespace: str,
        name: str,
        content: C,
        client: str,
        owner: str | None,
        bounds: Bounds,
        is_expected: Callable[[str | None], bool] = _whatever,
    ) -> Literal["added", "replaced", "same", "changed", "unknown", "of_another", "exists", "full", "too_many"]:
        """Let an id of a namespace stand for a content, whether it stands for another or for none before.

        Args:
            connection: The transaction.
            namespace: Where the id is looked up first.
            name: The id.
            content: The content of the id.
            client: The client that adds it.
            owner: The client that must have added an earlier content; None: anybody may have.
            bounds: The bounds on contents of the kind.
            is_expected: Whether the digest of the earlier content is the expected one; None: there is no content.

        Returns:
            `same`: it stands for the content already. `changed`: the earlier content is not the expected one. For the
            others see `add` and `replace`.
        """
        exclusively(connection, CONTENTS)
        before = self.digests(connection, namespace, {name}).get(name)
        if before == content.digest:
            return "same"
        if not is_expected(before):
            return "changed"
        added = self.add(connection, namespace, name, content, client, bounds)
        if added != "exists" or before is None:
            return added
        return self.replace(connection, namespace, name, before, content, owner, bounds)

    def delete(
        self,
        connection: Connection,
        namespace: str,
        name: str,
        owner: str | None,
        is_expected: Callable[[str | None], bool] = _whatever,
    ) -> Literal["deleted", "unknown", "of_another", "changed"]:
        """Forget an id of a namespace, or else of all, and the content that nothing else needs.

        Args:
            connection: The transaction.
            namespace: Where the id is looked up first.
            name: The id.
            owner: The client that must have added it; None: anybody may have.
            is_expected: Whether the digest of the content is the expected one; `changed` is returned if not.
        """
        exclusively(connection, CONTENTS)
        kept = self.owned(connection, namespace, name, owner)
        if isinstance(kept, str):
            return kept
        if not is_expected(kept.digest):
            return "changed"
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
        query = select(ids.c.id, self.contents.c.summary, ids.c.added).join(self.contents).where(is_seen)
        rows = connection.execute(query.where(order > name).order_by(order).limit(limit))
        return [(row.id, self.entry(row.id, row.summary, row.added)) for row in rows]

    def entry_of(self, connection: Connection, namespace: str, name: str) -> bytes | None:
        """Find the entry of an id in the list of all; None: it stands for nothing."""
        query = select(self.contents.c.summary, self.ids.c.added).join(self.ids).where(self._seen_as(namespace, name))
        row = connection.execute(query.order_by(self.ids.c.namespace.desc()).limit(1)).one_or_none()
        return None if row is None else self.entry(name, row.summary, row.added)

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
        if self.needed_by_item is None:
            return or_(by_id, false())
        return or_(by_id, select(items.c.batch).where(self.needed_by_item == digest).exists())

    def _size(self, connection: Connection, *which: ColumnElement[bool]) -> int:
        """Add up the bytes of some of the contents."""
        total = select(func.coalesce(func.sum(self.contents.c.size), 0)).where(*which)
        size: int = connection.execute(total).scalar_one()
        return size


def find_visuals(connection: Connection, namespace: str, robot_id: str) -> bytes:
    """Find the visual meshes of a robot as glTF; empty: there are none."""
    ids = ROBOTS.ids.c
    query = select(robot_contents.c.visuals).join(ROBOTS.ids)
    found = query.where(ids.id == robot_id, ids.namespace.in_([namespace, FOR_ALL])).order_by(ids.namespace.desc())
    return connection.scalar(found.limit(1)) or b""


ROBOTS = NamedContents(robots, robot_contents, items.c.robot, RobotContent)
"""The robots that clients add."""

SCENES = NamedContents(scenes, scene_contents, items.c.scene, SceneContent)
"""The scenes that clients add."""

PROJECTS = NamedContents(projects, project_contents, None, ProjectContent, project_entry)
"""The projects that clients save."""
