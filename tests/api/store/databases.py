"""Databases for tests: SQLite in a folder, and a real PostgreSQL on a port of the loopback interface."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from sqlalchemy import make_url

from api.store.database import make_engine, sqlite_url
from api.store.migrate import upgrade
from tests.api.conftest import free_port, wait_until

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Engine

PROGRAMS = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
"""Where Debian's package has PostgreSQL, one folder a version."""


class PostgresServer:
    """A private PostgreSQL server that a test can stop and restart; it runs as an unprivileged user."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._programs = PROGRAMS[-1].parent
        self._port = free_port()
        self._process: subprocess.Popen[bytes] | None = None
        self._as: dict[str, Any] = {}
        if os.getuid() == 0:  # it refuses to run as root
            user = pwd.getpwnam("postgres")
            shutil.chown(folder, user.pw_uid)
            self._as = {"user": user.pw_uid, "group": user.pw_gid, "extra_groups": []}
        initdb = [self._programs / "initdb", "-D", folder / "data", "-U", "tests", "-A", "trust", "--no-sync"]
        subprocess.run(
            [*initdb, "-E", "UTF8", "--locale=C.UTF-8"], check=True, capture_output=True, cwd="/", **self._as
        )

    def start(self) -> None:
        options = {"port": self._port, "listen_addresses": "127.0.0.1", "fsync": "off", "shared_buffers": "16MB"}
        options |= {"unix_socket_directories": self._folder, "max_connections": 40}
        command = [self._programs / "postgres", "-D", self._folder / "data"]
        command += [argument for name, value in options.items() for argument in ("-c", f"{name}={value}")]
        self._process = subprocess.Popen(command, cwd="/", stderr=subprocess.DEVNULL, **self._as)
        ready = [self._programs / "pg_isready", "-q", "-h", "127.0.0.1", "-p", str(self._port)]
        wait_until(lambda: subprocess.run(ready, check=False).returncode == 0)

    def stop(self) -> None:
        """Stop it without waiting for its clients."""
        if self._process is not None:
            self._process.send_signal(signal.SIGQUIT)
            self._process.wait()

    def new_database(self, name: str) -> str:
        """Make an empty database and give its URL."""
        psql = [self._programs / "psql", "-q", "-h", "127.0.0.1", "-p", str(self._port), "-U", "tests", "postgres"]
        subprocess.run([*psql, "-c", f"CREATE DATABASE {name}"], check=True, capture_output=True, cwd="/")
        return f"postgresql://tests@127.0.0.1:{self._port}/{name}"


@contextmanager
def postgres_server() -> Iterator[PostgresServer]:
    if not PROGRAMS:
        pytest.skip("PostgreSQL is not installed: apt-get install postgresql")
    folder = Path(tempfile.mkdtemp(prefix="postgresql-"))  # pytest's own folders are open to root alone
    try:
        server = PostgresServer(folder)
        server.start()
        yield server
        server.stop()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="session")
def postgres() -> Iterator[PostgresServer]:
    with postgres_server() as server:
        yield server


@pytest.fixture(scope="module", params=["sqlite", "postgresql"])
def engine(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Engine]:
    """Connections to a database of each kind with the tables of this version."""
    if request.param == "sqlite":
        url = sqlite_url(tmp_path_factory.mktemp("database"))
    else:
        name = request.module.__name__.rpartition(".")[2]
        url = make_url(request.getfixturevalue("postgres").new_database(name)).set(drivername="postgresql+psycopg")
    engine = make_engine(url)
    upgrade(engine)
    yield engine
    engine.dispose()
