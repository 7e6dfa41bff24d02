"""Roadmaps that stay with scenes, at most one for each robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from sqlalchemy import and_, delete, exists, func, insert, not_, select

from api.store.contents.digests import sha256
from api.store.contents.roadmaps import RoadmapContent
from api.store.locks import CONTENTS, exclusively
from api.store.named_contents import FOR_ALL, ROBOTS, SCENES
from api.store.tables import items, roadmap_contents, roadmaps

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from sqlalchemy import ColumnElement, Connection

    from api.store.contents.scenes import SceneContent
    from api.store.items import NewItem


class StoredRoadmap(NamedTuple):
    """A roadmap of a scene.

    Attributes:
        roadmap: The roadmap.
        is_of_robot: Whether it was built for the robot that its id names now.
        is_of_scene: Whether it was proved for the scene as it is.
    """

    roadmap: RoadmapContent
    is_of_robot: bool
    is_of_scene: bool


class RoadmapBounds(NamedTuple):
    """The bounds on the roadmaps of one scene.

    Attributes:
        number: The most roadmaps.
        size: The most bytes of roadmaps.
    """

    number: int
    size: int


def roadmaps_of(
    connection: Connection, namespace: str, scene_id: str
) -> tuple[SceneContent, list[StoredRoadmap]] | None:
    """Read a scene with its roadmaps, in the order of the robots; None: there is no such scene."""
    scene = SCENES.find(connection, namespace, scene_id)
    owned = SCENES.owned(connection, namespace, scene_id, None)
    if scene is None or isinstance(owned, str):
        return None
    rows = connection.execute(select(roadmaps).where(_of_scene(owned)).order_by(roadmaps.c.robot)).all()
    digests = ROBOTS.digests(connection, namespace, {row.robot for row in rows})
    found = [
        StoredRoadmap(
            RoadmapContent(row.robot, row.definition_digest, row.request, row.content, row.summary),
            row.definition_digest == digests.get(row.robot, ""),
            row.scene_digest == scene.digest,
        )
        for row in rows
    ]
    return scene, found


def find_roadmap(
    connection: Connection, namespace: str, scene_id: str, scene_digest: str, robot: str, definition_digest: str
) -> bytes | None:
    """Find the roadmap of a robot in a scene with this content; None: there is none, or of another state.

    Args:
        connection: The transaction.
        namespace: Where the scene is looked up first.
        scene_id: The id of the scene.
        scene_digest: The digest of the content of the scene.
        robot: The id of the robot.
        definition_digest: The digest of the definition of an added robot; empty: a robot of the catalogue.
    """
    is_asked = and_(
        roadmaps.c.namespace.in_([namespace, FOR_ALL]),
        roadmaps.c.scene == scene_id,
        roadmaps.c.scene_digest == scene_digest,
        roadmaps.c.robot == robot,
        roadmaps.c.definition_digest == definition_digest,
    )
    order = roadmaps.c.namespace.desc()
    found: bytes | None = connection.scalar(select(roadmaps.c.content).where(is_asked).order_by(order).limit(1))
    return found


def keep_for_items(
    connection: Connection,
    namespace: str,
    chunk: Sequence[NewItem],
    robots: Mapping[str, str],
    scenes: Mapping[str, str],
) -> list[str | None]:
    """Keep the roadmaps that items of batches need; return the digest of each item's, None where there is none.

    Args:
        connection: The transaction.
        namespace: Where scenes are looked up first.
        chunk: The items.
        robots: The digests of their added robots by id.
        scenes: The digests of their scenes by id.
    """
    digests: dict[tuple[str, str], str | None] = {}

    def kept(scene: str, robot: str) -> str | None:
        content = find_roadmap(connection, namespace, scene, scenes[scene], robot, robots.get(robot, ""))
        if content is None:
            return None
        digest = sha256(content)
        if not connection.scalar(select(exists().where(roadmap_contents.c.digest == digest))):
            connection.execute(insert(roadmap_contents).values(digest=digest, definition=content))
        return digest

    found: list[str | None] = []
    for item in chunk:
        if not item.may_be_free or item.robot is None or item.scene is None or item.scene not in scenes:
            found.append(None)
            continue
        pair = item.scene, item.robot
        if pair not in digests:
            digests[pair] = kept(*pair)
        found.append(digests[pair])
    return found


def forget_of_items(connection: Connection, digests: Iterable[str | None]) -> None:
    """Delete roadmaps that no item of a batch needs."""
    digest = roadmap_contents.c.digest
    needed = select(items.c.batch).where(items.c.roadmap == digest).exists()
    connection.execute(delete(roadmap_contents).where(digest.in_(list(digests)), not_(needed)))


def keep_roadmap(
    connection: Connection,
    namespace: str,
    scene_id: str,
    scene_digest: str,
    roadmap: RoadmapContent,
    owner: str | None,
    bounds: RoadmapBounds,
) -> Literal["added", "replaced", "changed", "unknown", "of_another", "too_many", "too_large"]:
    """Keep a roadmap with a scene, in the place of an earlier one of the same robot.

    Args:
        connection: The transaction.
        namespace: Where the scene is looked up first.
        scene_id: The id of the scene.
        scene_digest: The digest of the content for which the roadmap was proved.
        roadmap: The roadmap.
        owner: The client that must have added the scene; None: anybody may have.
        bounds: The bounds on the roadmaps of a scene.

    Returns:
        `changed`: the scene has another content by now. `too_many`, `too_large`: the scene has no room for it.
    """
    exclusively(connection, CONTENTS)
    scene = SCENES.owned(connection, namespace, scene_id, owner)
    if isinstance(scene, str):
        return scene
    if scene.digest != scene_digest:
        return "changed"
    of_robot = _of_scene(scene) & (roadmaps.c.robot == roadmap.robot)
    others = _of_scene(scene) & (roadmaps.c.robot != roadmap.robot)
    sums = select(func.count(), func.coalesce(func.sum(roadmaps.c.size), 0)).select_from(roadmaps).where(others)
    count, size = connection.execute(sums).one()
    if count >= bounds.number:
        return "too_many"
    if size + roadmap.size > bounds.size:
        return "too_large"
    is_replaced = connection.execute(delete(roadmaps).where(of_robot)).rowcount > 0
    values = {"namespace": scene.namespace, "scene": scene.id, "scene_digest": scene_digest, "size": roadmap.size}
    connection.execute(insert(roadmaps).values(**vars(roadmap), **values))
    return "replaced" if is_replaced else "added"


def delete_roadmap(
    connection: Connection, namespace: str, scene_id: str, robot: str, owner: str | None
) -> Literal["deleted", "no_roadmap", "unknown", "of_another"]:
    """Delete the roadmap of a robot in a scene; see `keep_roadmap` for the arguments."""
    exclusively(connection, CONTENTS)
    scene = SCENES.owned(connection, namespace, scene_id, owner)
    if isinstance(scene, str):
        return scene
    deleted = connection.execute(delete(roadmaps).where(_of_scene(scene), roadmaps.c.robot == robot)).rowcount
    return "deleted" if deleted else "no_roadmap"


def _of_scene(scene: Any) -> ColumnElement[bool]:
    """Choose the roadmaps of a row of the table of scenes."""
    return and_(roadmaps.c.namespace == scene.namespace, roadmaps.c.scene == scene.id)
