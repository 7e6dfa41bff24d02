"""Batches of plan requests, their items, and the services that work on them."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
"""The name of this migration."""

down_revision = "0001"
"""The name of the one before."""


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "engines",
        sa.Column("id", sa.Text(), nullable=False),
        sa.Column("seen", sa.Float(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_engines"),
    )
    op.create_table(
        "batches",
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("id", sa.Text(), nullable=False),
        sa.Column("owner", sa.Text(), nullable=False),
        sa.Column("idempotency_key", sa.Text()),
        sa.Column("body_digest", sa.Text()),
        sa.Column("status", sa.Text(), nullable=False),
        sa.Column("engine", sa.Text()),
        sa.Column("total", sa.Integer(), nullable=False),
        sa.Column("size", sa.BigInteger(), nullable=False),
        sa.Column("created", sa.Float(), nullable=False),
        sa.Column("ended", sa.Float()),
        sa.Column("settled", sa.Float()),
        sa.Column("rate", sa.Float()),
        sa.PrimaryKeyConstraint("number", name="pk_batches"),
        sa.UniqueConstraint("id", name="uq_batches_id"),
    )
    op.create_index("batches_by_key", "batches", ["owner", "idempotency_key"], unique=True)
    op.create_index("batches_by_status", "batches", ["status"])
    op.create_table(
        "items",
        sa.Column("batch", sa.Integer(), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("request", sa.LargeBinary(), nullable=False),
        sa.Column("robot", sa.Text()),
        sa.Column("deadline", sa.Float(), nullable=False),
        sa.Column("engine", sa.Text()),
        sa.Column("outcome", sa.Text()),
        sa.Column("duration", sa.Float()),
        sa.Column("ratio", sa.Float()),
        sa.Column("result", sa.LargeBinary()),
        sa.ForeignKeyConstraint(["batch"], ["batches.number"], name="fk_items_batch"),
        sa.ForeignKeyConstraint(["robot"], ["robot_contents.digest"], name="fk_items_robot"),
        sa.PrimaryKeyConstraint("batch", "position", name="pk_items"),
    )
    left = sa.text("outcome IS NULL")
    op.create_index("items_left", "items", ["batch", "position"], sqlite_where=left, postgresql_where=left)
    op.create_index("items_by_outcome", "items", ["batch", "outcome", "duration", "ratio"])
    op.create_index("items_by_robot", "items", ["robot"])
