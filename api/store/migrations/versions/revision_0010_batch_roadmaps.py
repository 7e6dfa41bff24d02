"""Roadmaps that items of batches keep."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
"""The name of this migration."""

down_revision = "0009"
"""The name of the one before."""


def upgrade() -> None:
    """Let items have a roadmap."""
    op.create_table(
        "roadmap_contents",
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("definition", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("digest", name="pk_roadmap_contents"),
    )
    op.execute(  # as the column of scenes
        "ALTER TABLE items ADD COLUMN roadmap TEXT CONSTRAINT fk_items_roadmap REFERENCES roadmap_contents (digest)"
    )
    op.create_index("items_by_roadmap", "items", ["roadmap"])
