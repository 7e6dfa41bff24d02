"""Visual meshes of robots."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
"""The name of this migration."""

down_revision = "0008"
"""The name of the one before."""


def upgrade() -> None:
    """Let robots have visual meshes."""
    op.add_column("robot_contents", sa.Column("visuals", sa.LargeBinary()))
