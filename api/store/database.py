"""The connection to the database, and the threads that wait for it."""

from __future__ import annotations

import asyncio
import shutil
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from fcntl import LOCK_EX, flock
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

import structlog
from sqlalchemy import NullPool, create_engine, event, literal, make_url, select
from sqlalchemy.exc import DatabaseError, DBAPIError, OperationalError

from api.base.errors import DatabaseUnavailable
from api.store.migrate import upgrade
from api.store.tables import metadata

if TYPE_CHECKING:
    from collections.abc import Callable

    from sqlalchemy import URL, Connection, Engine, Pool

    from api.base.settings import Settings

P = ParamSpec("P")
T = TypeVar("T")

log = structlog.get_logger()

LOOK_TIMEOUT = 2.0
"""The time within which a look at the database has to end, s: shorter than the patience of a readiness probe."""

LOOK_AGAIN = 1.0
"""The time for which the result of a check is given again, s: anybody may ask at any rate."""

BUSY_TIMEOUT = 30_000
"""The time for which SQLite waits for another process that writes, ms: many times that of any transaction."""

FILE_NAME = "planner.sqlite3"
"""The name of SQLite's file in the data directory."""


class Database:
    """The database of one service.

    The event loop must never wait for it. A commit waits for the disk, another process may hold a lock, and the network
    to PostgreSQL may stall. So all statements run in threads, which leave the interpreter to the event loop while they
    wait. A process of its own would cost more memory, and copies of all rows. One thread writes, since SQLite lets no
    two write at once; others read, and need not wait for it.

    Args:
        url: Where it is; None: a temporary one, for as long as the service runs.
        reading_threads: The number of threads that read: so many answers wait for the disk or the network at once.
    """

    engine: Engine

    def __init__(self, url: URL | None, reading_threads: int = 2) -> None:
        self._url = url
        self._temporary: Path | None = None
        self._writer = ThreadPoolExecutor(1, "database-writer")
        self._readers = ThreadPoolExecutor(reading_threads, "database-reader")
        self._looker = ThreadPoolExecutor(1, "database-looker")
        self._look: asyncio.Future[bool] | None = None
        self._looked = 0.0

    def open(self) -> None:
        """Bring its tables up to date. It waits: call it before there are requests.

        Raises:
            DatabaseTooNew: A later version of the service has changed its tables.
            OperationalError: There is no connection.
        """
        url = self._url
        if url is None:
            self._temporary = Path(tempfile.mkdtemp(prefix="planner-"))
            url = sqlite_url(self._temporary)
        self.engine = make_engine(url)
        self._reading = self.engine.execution_options(reads=True)
        self._fresh = make_engine(url, NullPool).execution_options(reads=True)
        upgrade(self.engine)

    async def read(self, work: Callable[Concatenate[Connection, P], T], *arguments: P.args, **options: P.kwargs) -> T:
        """Run a function that reads, with a connection and its arguments, in a transaction.

        Raises:
            DatabaseUnavailable: There is no connection, or it broke.
        """
        return await self._execute(self._readers, True, lambda connection: work(connection, *arguments, **options))

    async def write(self, work: Callable[Concatenate[Connection, P], T], *arguments: P.args, **options: P.kwargs) -> T:
        """Run a function that writes, as `read` does; all that it writes is written together, or nothing."""
        return await self._execute(self._writer, False, lambda connection: work(connection, *arguments, **options))

    async def is_readable(self) -> bool:
        """Tell whether all tables can be read within a short time."""
        now = time.monotonic()
        if self._look is None or (self._look.done() and now - self._looked > LOOK_AGAIN):
            self._look = asyncio.get_running_loop().run_in_executor(self._looker, self._read_each_table)
            self._looked = now
        try:
            return await asyncio.wait_for(asyncio.shield(self._look), LOOK_TIMEOUT)
        except TimeoutError:
            return False

    def _read_each_table(self) -> bool:
        """Read from each table through a new connection: a kept one may have deleted files open."""
        try:
            with self._fresh.connect() as connection:
                for table in metadata.sorted_tables:
                    connection.execute(select(literal(1)).select_from(table).limit(1)).first()
        except DBAPIError as error:
            log.warning("database_unavailable", reason=str(error.orig).partition("\n")[0])
            return False
        return True

    async def _execute(self, threads: ThreadPoolExecutor, reads: bool, work: Callable[[Connection], T]) -> T:
        def transaction() -> T:
            with (self._reading if reads else self.engine).begin() as connection:
                return work(connection)

        try:
            return await asyncio.get_running_loop().run_in_executor(threads, transaction)
        except DBAPIError as error:
            is_corrupt = type(error) is DatabaseError  # what SQLite says of a file that is none of its own, or damaged
            if isinstance(error, OperationalError) or error.connection_invalidated or is_corrupt:
                log.warning("database_unavailable", reason=str(error.orig).partition("\n")[0])
                raise DatabaseUnavailable(
                    "The database does not answer. Retry after 5 s.", headers={"Retry-After": "5"}
                ) from error
            raise

    def close(self) -> None:
        """Wait for the statements under way and end all connections; a temporary database is deleted."""
        self._writer.shutdown()
        self._readers.shutdown()
        self._looker.shutdown(wait=False, cancel_futures=True)
        self.engine.dispose()
        if self._temporary is not None:
            shutil.rmtree(self._temporary, ignore_errors=True)


def database_url(settings: Settings) -> URL | None:
    """Find out where the database is: at a URL, in the data directory, or, None, in a temporary one."""
    if settings.database_url is not None:
        return make_url(settings.database_url.get_secret_value()).set(drivername="postgresql+psycopg")
    return None if settings.data_directory is None else sqlite_url(settings.data_directory)


def sqlite_url(directory: Path) -> URL:
    """Make the URL of SQLite's file in a folder."""
    return make_url("sqlite://").set(database=str(directory / FILE_NAME))


def make_engine(url: URL, pool: type[Pool] | None = None) -> Engine:
    """Prepare connections to a database; none is made yet. A pool keeps them; None: that of the database's kind."""
    if url.get_backend_name() != "sqlite":
        return create_engine(url, pool_pre_ping=True, poolclass=pool)
    file = Path(str(url.database))
    file.parent.mkdir(parents=True, exist_ok=True)
    _keep_private(file)
    engine = create_engine(url, poolclass=pool)
    event.listen(engine, "connect", _set_up_sqlite)
    event.listen(engine, "begin", _begin)
    return engine


def _keep_private(file: Path) -> None:
    """Let only the owner read SQLite's file and the files beside it, also older ones."""
    for suffix in ("", "-lock"):
        Path(f"{file}{suffix}").touch(mode=0o600)  # SQLite gives what it puts beside the file the same mode
    for suffix in ("", "-lock", "-wal", "-shm"):
        with suppress(FileNotFoundError, PermissionError):  # another process deletes it, or another user owns it
            Path(f"{file}{suffix}").chmod(0o600)


def _set_up_sqlite(connection: Any, _record: Any) -> None:
    """Let readers go on while one writes, and let transactions begin where SQLAlchemy says so."""
    connection.isolation_level = None
    for pragma in (f"busy_timeout={BUSY_TIMEOUT}", "synchronous=FULL", "foreign_keys=ON"):
        connection.execute(f"PRAGMA {pragma}")
    ((_, _, file),) = connection.execute("PRAGMA database_list")
    with Path(f"{file}-lock").open("wb") as lock:  # SQLite does not wait where two change the journal at once
        flock(lock, LOCK_EX)
        connection.execute("PRAGMA journal_mode=WAL")


def _begin(connection: Connection) -> None:
    """Begin a transaction; one that will write takes the lock at once."""
    reads = connection.get_execution_options().get("reads", False)
    connection.exec_driver_sql("BEGIN" if reads else "BEGIN IMMEDIATE")
