"""Bring the tables of a database to what this version of the service works with."""

from __future__ import annotations

from typing import TYPE_CHECKING

from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory

from api.store.locks import MIGRATIONS, exclusively

if TYPE_CHECKING:
    from sqlalchemy import Engine


class DatabaseTooNew(Exception):
    """A later version of the service has changed the tables."""


def upgrade(engine: Engine) -> None:
    """Apply the missing migrations, all or none, while other services wait.

    Raises:
        DatabaseTooNew: The database is that of a later version.
    """
    with engine.begin() as connection:
        exclusively(connection, MIGRATIONS)
        config = _config()
        revision = MigrationContext.configure(connection).get_current_revision()
        script = ScriptDirectory.from_config(config)
        if revision is not None and revision not in {known.revision for known in script.walk_revisions()}:
            raise DatabaseTooNew(
                f"The database has revision {revision}, which this version does not know. Install the newer version."
            )
        config.attributes["connection"] = connection
        command.upgrade(config, "head")


def is_current(engine: Engine) -> bool:
    """Tell whether the tables have this version."""
    head = ScriptDirectory.from_config(_config()).get_current_head()
    with engine.execution_options(reads=True).connect() as connection:
        return MigrationContext.configure(connection).get_current_revision() == head


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", "api.store:migrations")
    return config
