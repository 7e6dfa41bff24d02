"""Items have the time that a worker took, and the index by outcome all that a report of a batch is made from."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
"""The name of this migration."""

down_revision = "0005"
"""The name of the one before."""


def upgrade() -> None:
    """Add the column, and make the index anew."""
    op.add_column("items", sa.Column("seconds", sa.Float()))
    op.drop_index("items_by_outcome", "items")
    op.create_index("items_by_outcome", "items", ["batch", "outcome", "duration", "ratio", "seconds", "position"])
