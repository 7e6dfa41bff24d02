"""Roadmaps of scenes, which go with their scenes."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
"""The name of this migration."""

down_revision = "0006"
"""The name of the one before."""


def upgrade() -> None:
    """Make the table."""
    op.create_table(
        "roadmaps",
        sa.Column("namespace", sa.Text(), nullable=False),
        sa.Column("scene", sa.Text(), nullable=False),
        sa.Column("robot", sa.Text(), nullable=False),
        sa.Column("definition_digest", sa.Text(), nullable=False),
        sa.Column("scene_digest", sa.Text(), nullable=False),
        sa.Column("request", sa.LargeBinary(), nullable=False),
        sa.Column("content", sa.LargeBinary(), nullable=False),
        sa.Column("summary", sa.LargeBinary(), nullable=False),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["namespace", "scene"], ["scenes.namespace", "scenes.id"], name="fk_roadmaps_scene", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("namespace", "scene", "robot", name="pk_roadmaps"),
    )
