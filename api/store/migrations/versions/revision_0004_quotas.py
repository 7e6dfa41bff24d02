"""Keys have quotas, and their requests are counted by the day."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
"""The name of this migration."""

down_revision = "0003"
"""The name of the one before."""


def upgrade() -> None:
    """Make the table of counts, and let keys have a quota."""
    op.add_column("keys", sa.Column("requests_per_day", sa.Integer()))
    op.create_table(
        "usage",
        sa.Column("key", sa.Text(), nullable=False),
        sa.Column("day", sa.Integer(), nullable=False),
        sa.Column("requests", sa.Integer(), nullable=False),
        sa.PrimaryKeyConstraint("key", "day", name="pk_usage"),
    )
