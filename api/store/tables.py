"""The tables. A change here needs a migration in `migrations/versions/`; a test compares the two."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sqlalchemy import (
    BigInteger,
    Column,
    Float,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    Table,
    Text,
    TypeDecorator,
    text,
)
from typing_extensions import override

if TYPE_CHECKING:
    from sqlalchemy import Dialect


class Id(TypeDecorator[str]):
    """An id by which clients name something, whatever they send.

    PostgreSQL takes no text with the character 0; in its place stands one that is in no id either.
    """

    impl = Text
    cache_ok = True

    @override
    def process_bind_param(self, value: str | None, dialect: Dialect) -> str | None:
        """Write an id as any database takes it."""
        return None if value is None else value.replace("\0", "\N{REPLACEMENT CHARACTER}")


metadata = MetaData(naming_convention={"pk": "pk_%(table_name)s", "fk": "fk_%(table_name)s_%(column_0_name)s"})
"""All tables, with names for their keys by which migrations can change them."""

robot_contents = Table(
    "robot_contents",
    metadata,
    Column("digest", Text, primary_key=True),
    Column("definition", LargeBinary, nullable=False),
    Column("description", LargeBinary, nullable=False),
    Column("summary", LargeBinary, nullable=False),
    Column("size", Integer, nullable=False),
    Column("visuals", LargeBinary),
)
"""What clients added as robots (`RobotContent`), each content once; `size` is in bytes. `visuals` is NULL for robots of
former versions."""

robots = Table(
    "robots",
    metadata,
    Column("namespace", Text, primary_key=True, server_default=""),
    Column("id", Id, primary_key=True),
    Column("digest", Text, ForeignKey(robot_contents.c.digest), nullable=False),
    Column("owner", Text, nullable=False),
    Column("added", Float, nullable=False),
    Index("robots_by_digest", "digest"),
    Index("robots_by_owner", "owner"),
)
"""The ids of added robots: the content that each stands for, who added it, and when it was added or last changed (s
since 1970). `namespace` is the key in whose requests the id has this meaning; empty: in all requests."""

scene_contents = Table(
    "scene_contents",
    metadata,
    Column("digest", Text, primary_key=True),
    Column("definition", LargeBinary, nullable=False),
    Column("summary", LargeBinary, nullable=False),
    Column("size", Integer, nullable=False),
)
"""What clients added as scenes (`SceneContent`), each content once; `size` is in bytes."""

scenes = Table(
    "scenes",
    metadata,
    Column("namespace", Text, primary_key=True),
    Column("id", Id, primary_key=True),
    Column("digest", Text, ForeignKey(scene_contents.c.digest), nullable=False),
    Column("owner", Text, nullable=False),
    Column("added", Float, nullable=False),
    Index("scenes_by_digest", "digest"),
    Index("scenes_by_owner", "owner"),
)
"""The ids of scenes, like the ids of robots."""

project_contents = Table(
    "project_contents",
    metadata,
    Column("digest", Text, primary_key=True),
    Column("definition", LargeBinary, nullable=False),
    Column("summary", LargeBinary, nullable=False),
    Column("size", Integer, nullable=False),
)
"""What clients saved as projects (`ProjectContent`), each content once; `size` is in bytes."""

projects = Table(
    "projects",
    metadata,
    Column("namespace", Text, primary_key=True),
    Column("id", Id, primary_key=True),
    Column("digest", Text, ForeignKey(project_contents.c.digest), nullable=False),
    Column("owner", Text, nullable=False),
    Column("added", Float, nullable=False),
    Index("projects_by_digest", "digest"),
    Index("projects_by_owner", "owner"),
)
"""The names of projects, like the ids of robots."""

roadmaps = Table(
    "roadmaps",
    metadata,
    Column("namespace", Text, primary_key=True),
    Column("scene", Id, primary_key=True),
    Column("robot", Id, primary_key=True),
    Column("definition_digest", Text, nullable=False),
    Column("scene_digest", Text, nullable=False),
    Column("request", LargeBinary, nullable=False),
    Column("content", LargeBinary, nullable=False),
    Column("summary", LargeBinary, nullable=False),
    Column("size", Integer, nullable=False),
    ForeignKeyConstraint(
        ["namespace", "scene"], [scenes.c.namespace, scenes.c.id], "fk_roadmaps_scene", ondelete="CASCADE"
    ),
)
"""The roadmaps of scenes (`RoadmapContent`), which go with their scenes. `definition_digest` is that of an added robot,
or empty for a robot of the catalogue. `scene_digest` is that of the scene for which the roadmap was proved."""

roadmap_contents = Table(
    "roadmap_contents",
    metadata,
    Column("digest", Text, primary_key=True),
    Column("definition", LargeBinary, nullable=False),
)
"""The roadmaps that items of batches need, whatever becomes of the roadmaps of scenes, each once."""

keys = Table(
    "keys",
    metadata,
    Column("id", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("digest", Text, nullable=False),
    Column("scopes", Text, nullable=False),
    Column("requests_per_minute", Integer),
    Column("concurrent_requests", Integer),
    Column("created", Float, nullable=False),
    Column("revoked", Float),
    Column("requests_per_day", Integer),
)
"""API keys (`api.base.api_keys.KeyRecord`); `scopes` are words."""

usage = Table(
    "usage",
    metadata,
    Column("key", Text, primary_key=True),
    Column("day", Integer, primary_key=True),
    Column("requests", Integer, nullable=False),
)
"""The requests that keys with a quota have sent, by the day (days since 1970, UTC)."""

engines = Table(
    "engines",
    metadata,
    Column("id", Text, primary_key=True),
    Column("seen", Float, nullable=False),
)
"""The services that work on batches, and when each was last alive (s since 1970)."""

batches = Table(
    "batches",
    metadata,
    Column("number", Integer, primary_key=True),
    Column("id", Id, nullable=False, unique=True),
    Column("owner", Text, nullable=False),
    Column("idempotency_key", Text),
    Column("body_digest", Text),
    Column("status", Text, nullable=False),
    Column("engine", Text),
    Column("total", Integer, nullable=False),
    Column("size", BigInteger, nullable=False),
    Column("created", Float, nullable=False),
    Column("ended", Float),
    Column("settled", Float),
    Column("rate", Float),
    Index("batches_by_key", "owner", "idempotency_key", unique=True),
    Index("batches_by_status", "status"),
)
"""Batches: `status` is `arriving` (at the service `engine`), `running`, `completed` or `cancelled`. `total` counts its
items, and `size` their bytes. `settled` is the time at which results were written last, and `rate` their number a
second."""

NOT_DONE = text("outcome IS NULL")
"""What holds for items that are still to be planned; an index has only these."""

items = Table(
    "items",
    metadata,
    Column("batch", Integer, ForeignKey(batches.c.number), primary_key=True),
    Column("position", Integer, primary_key=True),
    Column("request", LargeBinary, nullable=False),
    Column("robot", Text, ForeignKey(robot_contents.c.digest)),
    Column("deadline", Float, nullable=False),
    Column("engine", Text),
    Column("outcome", Text),
    Column("duration", Float),
    Column("ratio", Float),
    Column("result", LargeBinary),
    Column("scene", Text, ForeignKey(scene_contents.c.digest)),
    Column("seconds", Float),
    Column("roadmap", Text, ForeignKey(roadmap_contents.c.digest)),
    Index("items_left", "batch", "position", sqlite_where=NOT_DONE, postgresql_where=NOT_DONE),
    Index("items_by_outcome", "batch", "outcome", "duration", "ratio", "seconds", "position"),
    Index("items_by_robot", "robot"),
    Index("items_by_scene", "scene"),
    Index("items_by_roadmap", "roadmap"),
)
"""The requests of batches, from position 0, compressed. Each has the digests of its added robot, scene and roadmap, the
deadline (s), the service that works on it, and its outcome. `outcome` is NULL (nothing yet), `planned` or the code of a
problem. `duration` (s) is of the trajectory, and `ratio` of its certificate. `seconds` is the time that a
worker took. `result` is the saved plan or the problem document. One index has all columns that are summed up and
sorted, so that nobody reads the results of a whole batch for it."""
