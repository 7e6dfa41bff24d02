"""The table of roadmaps, on SQLite and on PostgreSQL: they stay with their scene, within bounds, and go with it."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import pytest
from sqlalchemy import func, select

from api.store.batches import Arrival, BatchBounds, append_items, begin_batch, discard_batches, open_batch
from api.store.claims import claim, definition_of
from api.store.contents.roadmaps import RoadmapContent
from api.store.contents.scenes import SceneContent
from api.store.items import NewItem
from api.store.named_contents import SCENES, Bounds
from api.store.roadmaps import RoadmapBounds, delete_roadmap, find_roadmap, keep_roadmap, roadmaps_of
from api.store.tables import roadmap_contents, roadmaps
from tests.api.store.databases import engine, postgres

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection, Engine

__all__ = ["engine", "postgres"]
WIDE = Bounds(ids=10, ids_of_owner=10, size=1000, size_of_owner=1000)
ROOMY = RoadmapBounds(number=4, size=1000)


@pytest.fixture
def connection(engine: Engine) -> Iterator[Connection]:
    """A transaction that is undone; one client has the scene `cell`."""
    with engine.connect() as connection:
        SCENES.add(connection, "", "cell", scene("x"), "me", WIDE)
        yield connection
        connection.rollback()


def scene(digest: str) -> SceneContent:
    return SceneContent(digest, b"{}", b"{}")


def roadmap(robot: str, content: bytes = b"nodes", of: str = "") -> RoadmapContent:
    return RoadmapContent(robot, of, b"{}", content, b'{"robot":"arm"}')


def test_items_of_batches_keep_the_roadmap_that_there_was_until_they_are_forgotten(connection: Connection) -> None:
    keep_roadmap(connection, "", "cell", "x", roadmap("arm"), "me", ROOMY)
    arrival = begin_batch(connection, "me", None, "engine", BatchBounds(1, 1, 10**6))
    assert isinstance(arrival, Arrival)
    new = [
        NewItem(b"free", "arm", "cell", 10.0, True),
        NewItem(b"straight", "arm", "cell", 10.0),
        NewItem(b"other", "leg", "cell", 10.0, True),
    ]
    append_items(connection, arrival.number, 0, [*new, new[0]], "")
    open_batch(connection, arrival.number, "digest")
    keep_roadmap(connection, "", "cell", "x", roadmap("arm", b"later"), "me", ROOMY)
    delete_roadmap(connection, "", "cell", "arm", "me")
    digests = [item.roadmap for item in claim(connection, "engine", 4)]
    assert digests == [digests[0], None, None, digests[0]]
    assert definition_of(connection, digests[0] or "") == b"nodes"
    discard_batches(connection, [arrival.number])
    assert connection.scalar(select(func.count()).select_from(roadmap_contents)) == 0


def test_a_roadmap_is_found_for_its_scene_and_robot_alone(connection: Connection) -> None:
    keep = partial(keep_roadmap, connection, "", "cell", owner="me", bounds=ROOMY)
    find = partial(find_roadmap, connection)
    assert keep("x", roadmap("arm")) == "added" and keep("x", roadmap("arm", b"more")) == "replaced"
    assert keep("x", roadmap("mine", b"own", of="d")) == "added"
    assert find("", "cell", "x", "arm", "") == b"more" and find("key:of_me", "cell", "x", "mine", "d") == b"own"
    for asked in (
        ("cell", "y", "arm", ""),
        ("cell", "x", "arm", "d"),
        ("cell", "x", "leg", ""),
        ("hall", "x", "arm", ""),
    ):
        assert find("", *asked) is None
    assert find("", "ce\0ll", "x", "a\0rm", "") is None


def test_a_changed_scene_leaves_roadmaps_that_are_not_current(connection: Connection) -> None:
    keep = partial(keep_roadmap, connection, "", "cell", owner="me", bounds=ROOMY)
    assert keep("x", roadmap("arm")) == "added" and keep("x", roadmap("mine", of="gone")) == "added"
    assert SCENES.replace(connection, "", "cell", "x", scene("y"), "me", WIDE) == "replaced"
    found = roadmaps_of(connection, "", "cell")
    assert found is not None and found[0] == scene("y")
    assert [(kept.roadmap.robot, kept.is_of_robot, kept.is_of_scene) for kept in found[1]] == [
        ("arm", True, False),
        ("mine", False, False),
    ]
    assert find_roadmap(connection, "", "cell", "y", "arm", "") is None
    assert keep("x", roadmap("arm")) == "changed" and keep("y", roadmap("arm", b"again")) == "replaced"
    assert find_roadmap(connection, "", "cell", "y", "arm", "") == b"again"


def test_the_roadmaps_of_a_scene_are_bounded_in_number_and_bytes(connection: Connection) -> None:
    size = roadmap("arm").size
    keep = partial(keep_roadmap, connection, "", "cell", "x", owner="me", bounds=RoadmapBounds(2, 2 * size + 3))
    assert [keep(roadmap(robot)) for robot in ("arm", "leg", "eye")] == ["added", "added", "too_many"]
    assert keep(roadmap("arm", b"nodes+++")) == "replaced"  # its own bytes of before do not count
    assert keep(roadmap("leg", b"nodes+")) == "too_large"
    found = roadmaps_of(connection, "", "cell")
    assert found is not None and [kept.roadmap.content for kept in found[1]] == [b"nodes+++", b"nodes"]


def test_the_owner_of_a_scene_alone_changes_its_roadmaps_which_go_with_it(connection: Connection) -> None:
    keep = partial(keep_roadmap, connection, "", scene_digest="x", roadmap=roadmap("arm"), bounds=ROOMY)
    assert keep("cell", owner="other") == "of_another" and keep("hall", owner="me") == "unknown"
    assert keep("cell", owner=None) == "added"
    gone = partial(delete_roadmap, connection, "")
    assert gone("cell", "arm", "other") == "of_another" and gone("hall", "arm", "me") == "unknown"
    assert gone("cell", "leg", "me") == "no_roadmap" and gone("cell", "arm", "me") == "deleted"
    assert keep("cell", owner="me") == "added"
    assert SCENES.delete(connection, "", "cell", "me") == "deleted"
    assert connection.scalar(select(func.count()).select_from(roadmaps)) == 0
    assert roadmaps_of(connection, "", "cell") is None
