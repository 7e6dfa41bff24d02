"""Scenes: contents by their digest, and ids that stand for them; items of batches keep their scenes."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
"""The name of this migration."""

down_revision = "0004"
"""The name of the one before."""


def upgrade() -> None:
    """Make the tables, and let items have a scene."""
    op.create_table(
        "scene_contents",
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("definition", sa.LargeBinary(), nullable=False),
        sa.Column("summary", sa.LargeBinary(), nullable=False),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.PrimaryKeyConstraint("digest", name="pk_scene_contents"),
    )
    op.create_table(
        "scenes",
        sa.Column("namespace", sa.Text(), nullable=False),
        sa.Column("id", sa.Text(), nullable=False),
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("owner", sa.Text(), nullable=False),
        sa.Column("added", sa.Float(), nullable=False),
        sa.ForeignKeyConstraint(["digest"], ["scene_contents.digest"], name="fk_scenes_digest"),
        sa.PrimaryKeyConstraint("namespace", "id", name="pk_scenes"),
    )
    op.create_index("scenes_by_digest", "scenes", ["digest"])
    op.create_index("scenes_by_owner", "scenes", ["owner"])
    op.execute(  # SQLite adds no foreign keys by themselves, and need not copy the table to add one with its column
        "ALTER TABLE items ADD COLUMN scene TEXT CONSTRAINT fk_items_scene REFERENCES scene_contents (digest)"
    )
    op.create_index("items_by_scene", "items", ["scene"])
