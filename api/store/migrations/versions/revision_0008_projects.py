"""Projects of the page: contents by their digest, and names that stand for them."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
"""The name of this migration."""

down_revision = "0007"
"""The name of the one before."""


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "project_contents",
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("definition", sa.LargeBinary(), nullable=False),
        sa.Column("summary", sa.LargeBinary(), nullable=False),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.PrimaryKeyConstraint("digest", name="pk_project_contents"),
    )
    op.create_table(
        "projects",
        sa.Column("namespace", sa.Text(), nullable=False),
        sa.Column("id", sa.Text(), nullable=False),
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("owner", sa.Text(), nullable=False),
        sa.Column("added", sa.Float(), nullable=False),
        sa.ForeignKeyConstraint(["digest"], ["project_contents.digest"], name="fk_projects_digest"),
        sa.PrimaryKeyConstraint("namespace", "id", name="pk_projects"),
    )
    op.create_index("projects_by_digest", "projects", ["digest"])
    op.create_index("projects_by_owner", "projects", ["owner"])
