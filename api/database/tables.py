"""The tables. A change here needs a migration in `migrations/versions/`; a test compares the two."""

from __future__ import annotations

from sqlalchemy import Column, Float, ForeignKey, Index, Integer, LargeBinary, MetaData, Table, Text

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
)
"""What clients added as robots (`RobotContent`), each content once; `size` is in bytes."""

robots = Table(
    "robots",
    metadata,
    Column("id", Text, primary_key=True),
    Column("digest", Text, ForeignKey(robot_contents.c.digest), nullable=False),
    Column("owner", Text, nullable=False),
    Column("added", Float, nullable=False),
    Index("robots_by_digest", "digest"),
    Index("robots_by_owner", "owner"),
)
"""The ids of added robots: the content that each stands for, who added it, and when (s since 1970)."""
