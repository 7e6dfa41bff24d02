"""Robots: contents by their digest, and ids that stand for them."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
"""The name of this migration."""

down_revision = None
"""The name of the one before."""


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "robot_contents",
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("definition", sa.LargeBinary(), nullable=False),
        sa.Column("description", sa.LargeBinary(), nullable=False),
        sa.Column("summary", sa.LargeBinary(), nullable=False),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.PrimaryKeyConstraint("digest", name="pk_robot_contents"),
    )
    op.create_table(
        "robots",
        sa.Column("id", sa.Text(), nullable=False),
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("owner", sa.Text(), nullable=False),
        sa.Column("added", sa.Float(), nullable=False),
        sa.ForeignKeyConstraint(["digest"], ["robot_contents.digest"], name="fk_robots_digest"),
        sa.PrimaryKeyConstraint("id", name="pk_robots"),
    )
    op.create_index("robots_by_digest", "robots", ["digest"])
    op.create_index("robots_by_owner", "robots", ["owner"])
