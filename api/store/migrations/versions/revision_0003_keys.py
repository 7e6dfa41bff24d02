"""API keys; ids of robots stand for contents in the namespace of a key, or in that of all."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
"""The name of this migration."""

down_revision = "0002"
"""The name of the one before."""


def upgrade() -> None:
    """Make the table of keys, and let robots have a namespace."""
    op.create_table(
        "keys",
        sa.Column("id", sa.Text(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("scopes", sa.Text(), nullable=False),
        sa.Column("requests_per_minute", sa.Integer()),
        sa.Column("concurrent_requests", sa.Integer()),
        sa.Column("created", sa.Float(), nullable=False),
        sa.Column("revoked", sa.Float()),
        sa.PrimaryKeyConstraint("id", name="pk_keys"),
    )
    with op.batch_alter_table("robots") as robots:
        robots.add_column(sa.Column("namespace", sa.Text(), nullable=False, server_default=""))
        robots.drop_constraint("pk_robots", type_="primary")
        robots.create_primary_key("pk_robots", ["namespace", "id"])
