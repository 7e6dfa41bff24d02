"""The database: its migrations, and the robots in it, on SQLite and on PostgreSQL."""

from __future__ import annotations

import asyncio
import json
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from fastapi import Request
from sqlalchemy import delete, func, insert, inspect, make_url, select, text
from typer.testing import CliRunner

from api.app import create_app
from api.base.api_keys import KeyRecord
from api.base.byte_budget import Traffic
from api.base.errors import DatabaseUnavailable
from api.base.settings import Settings
from api.http.dependencies import read_body
from api.http.replies import get_reply
from api.pool.messages import Reply
from api.store.batches import Arrival, BatchBounds, append_items, begin_batch, find_batch
from api.store.clients import Client
from api.store.contents.robots import RobotContent
from api.store.contents.scenes import SceneContent
from api.store.database import FILE_NAME, Database, make_engine, sqlite_url
from api.store.items import NewItem
from api.store.keys import add_key, all_keys, find_key, revoke_key
from api.store.migrate import DatabaseTooNew, _config, is_current, upgrade
from api.store.named_contents import ROBOTS, SCENES, Bounds
from api.store.tables import items, metadata, robot_contents, robots, scene_contents
from cli import app
from tests.api.made_up_service import WorkersInTheProcess, made_up_service
from tests.api.store.databases import PostgresServer, engine, postgres

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from sqlalchemy import Connection, Engine

__all__ = ["engine", "postgres"]
WIDE = Bounds(ids=10, ids_of_owner=10, size=1000, size_of_owner=10**6)


@pytest.fixture
def connection(engine: Engine) -> Iterator[Connection]:
    """A transaction that is undone."""
    with engine.connect() as connection:
        yield connection
        connection.rollback()


def test_the_migrations_make_the_tables_that_the_code_works_with(connection: Connection) -> None:
    assert compare_metadata(MigrationContext.configure(connection), metadata) == []


def test_migrations_that_come_at_once_are_applied_once(engine: Engine, tmp_path: Path) -> None:
    """Three services that start together on an empty database."""
    if engine.dialect.name == "sqlite":
        url = sqlite_url(tmp_path)
    else:
        with engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            connection.execute(text("CREATE DATABASE three_at_once"))
        url = engine.url.set(database="three_at_once")
    engines = [make_engine(url) for _ in range(3)]
    with ThreadPoolExecutor(3) as threads:
        list(threads.map(upgrade, engines))
    assert all(map(is_current, engines))
    assert set(inspect(engines[0]).get_table_names()) == {*metadata.tables, "alembic_version"}
    for each in engines:
        each.dispose()


def test_a_database_of_a_later_version_is_left_alone(tmp_path: Path) -> None:
    engine = make_engine(sqlite_url(tmp_path))
    upgrade(engine)
    with engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = 'of tomorrow'"))
    with pytest.raises(DatabaseTooNew, match="of tomorrow"):
        upgrade(engine)
    assert not is_current(engine)
    engine.dispose()


def test_robots_that_were_added_before_there_were_keys_are_everybodys(tmp_path: Path) -> None:
    engine = make_engine(sqlite_url(tmp_path))
    with engine.begin() as connection:
        config = _config()
        config.attributes["connection"] = connection
        command.upgrade(config, "0002")
        former = {name: value for name, value in vars(content("x")).items() if name != "visuals"}
        connection.execute(insert(robot_contents).values(**former, size=0))
        connection.execute(text("INSERT INTO robots (id, digest, owner, added) VALUES ('arm', 'x', '127.0.0.1', 0)"))
    upgrade(engine)
    with engine.begin() as connection:
        assert ROBOTS.find(connection, "key:of_somebody", "arm") == content("x")
        assert ROBOTS.behind(connection, "key:of_somebody", "", 10) == [("arm", b'{"id":"arm","dof":1}')]
        assert ROBOTS.delete(connection, "key:of_somebody", "arm", "key:of_somebody") == "of_another"
        assert ROBOTS.delete(connection, "key:of_an_admin", "arm", None) == "deleted"
    engine.dispose()


@pytest.mark.large_only
def test_the_command_line_upgrades_and_checks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def planner(*arguments: str) -> int:
        return CliRunner().invoke(app, ["db", *arguments]).exit_code

    assert planner("check") == 2  # no database is named
    monkeypatch.setenv("PLANNER_DATA_DIRECTORY", str(tmp_path / "new"))
    assert [planner(command) for command in ("check", "upgrade", "check")] == [1, 0, 0]
    monkeypatch.setenv("PLANNER_DATABASE_URL", "postgresql://nobody@127.0.0.1:1/nothing")
    assert planner("check") == 1
    monkeypatch.setenv("PLANNER_DATABASE_URL", "mysql://nobody@127.0.0.1/nothing")
    assert planner("check") == 2


def test_reading_does_not_wait_for_writing_and_the_event_loop_for_neither(tmp_path: Path) -> None:
    database = Database(sqlite_url(tmp_path))
    database.open()
    writing, go_on = threading.Event(), threading.Event()

    def slow_write(connection: Connection) -> None:
        connection.execute(delete(robots))
        writing.set()
        assert go_on.wait(10.0)

    async def meanwhile() -> Any:
        slow = asyncio.ensure_future(database.write(slow_write))
        while not writing.is_set():
            await asyncio.sleep(0.001)
        found = await database.read(count_robots)
        assert not slow.done()
        go_on.set()
        await slow
        return found

    assert asyncio.run(meanwhile()) == 0
    database.close()


def test_so_many_threads_read_at_the_same_time_as_the_setting_says(tmp_path: Path) -> None:
    settings = Settings(data_directory=tmp_path, database_reading_threads=4)
    database: Database = create_app(settings, WorkersInTheProcess(settings)).state.service.database  # type: ignore[arg-type]
    database.open()
    all_read = threading.Barrier(4)

    def read_with_others(_connection: Connection) -> int:
        return all_read.wait(30.0)

    async def read() -> set[int]:
        return set(await asyncio.gather(*(database.read(read_with_others) for _ in range(4))))

    assert asyncio.run(read()) == {0, 1, 2, 3}
    database.close()


@pytest.mark.large_only
def test_a_database_that_is_gone_is_a_problem_and_comes_back(postgres: PostgresServer) -> None:
    database = Database(make_url(postgres.new_database("comes_and_goes")).set(drivername="postgresql+psycopg"))
    database.open()
    assert asyncio.run(database.read(count_robots)) == 0
    postgres.stop()
    with pytest.raises(DatabaseUnavailable):
        asyncio.run(database.read(count_robots))
    postgres.start()
    assert asyncio.run(database.read(count_robots)) == 0
    database.close()


def count_robots(connection: Connection) -> Any:
    return connection.scalar(select(func.count()).select_from(robots))


def test_a_temporary_database_leaves_nothing_behind() -> None:
    database = Database(None)
    database.open()
    folder = database._temporary
    assert folder is not None and folder.is_dir()
    database.close()
    assert not folder.exists()


def content(digest: str, size: int = 0) -> RobotContent:
    return RobotContent(digest, b"x" * size, b'{"dof":1}', b'{"dof":1}')


def test_a_content_is_kept_once_and_as_long_as_an_id_stands_for_it(connection: Connection) -> None:
    add = partial(ROBOTS.add, connection, "", owner="me", bounds=WIDE._replace(ids=3))
    assert [add(robot_id, content("x")) for robot_id in ("b", "a", "a")] == ["added", "added", "same"]
    assert ROBOTS.find(connection, "", "a") == ROBOTS.find(connection, "", "b") == content("x")
    assert add("a", content("y")) == "exists"
    assert add("c", content("y")) == "added"
    assert add("d", content("y")) == "full"
    assert [digest for (digest,) in connection.execute(select(robot_contents.c.digest))] == ["x", "y"]
    assert [ROBOTS.delete(connection, "", "b", "me") for _ in range(2)] == ["deleted", "unknown"]
    assert ROBOTS.find(connection, "", "a") == content("x")
    assert ROBOTS.delete(connection, "", "a", "me") == "deleted"
    assert [digest for (digest,) in connection.execute(select(robot_contents.c.digest))] == ["y"]
    assert add("a", content("y")) == "added"


def test_ids_are_listed_in_their_order(connection: Connection) -> None:
    for robot_id in ("b", "Z", "a.1", "a", "_"):
        ROBOTS.add(connection, "", robot_id, content("x"), "me", WIDE)
    listed = ROBOTS.behind(connection, "", "", 10)
    assert [robot_id for robot_id, _ in listed] == ["Z", "_", "a", "a.1", "b"]
    assert ROBOTS.behind(connection, "", "_", 2) == [("a", b'{"id":"a","dof":1}'), ("a.1", b'{"id":"a.1","dof":1}')]


@pytest.mark.parametrize("name", ["\0", "a\0", "\N{REPLACEMENT CHARACTER}"])
def test_nothing_has_an_id_that_no_database_takes(connection: Connection, name: str) -> None:
    """PostgreSQL refuses such a text, and the client got an internal error."""
    ROBOTS.add(connection, "", "a", content("x"), "me", WIDE)
    for kind in (ROBOTS, SCENES):
        assert kind.find(connection, "", name) is None
        assert kind.digests(connection, "", {name, None}) == {}
        assert kind.delete(connection, "", name, "me") == "unknown"
        assert kind.behind(connection, "", "b" + name, 10) == []
    assert SCENES.replace(connection, "", name, "x", scene("y"), "me", WIDE) == "unknown"
    assert find_batch(connection, name) is None


def test_keys_are_kept_found_and_revoked(connection: Connection) -> None:
    record = KeyRecord("0f3a", "cell 4", "digest", frozenset({"plan", "robots:write"}), 100, None, 1.0, None)
    add_key(connection, record)
    add_key(connection, record._replace(id="00ff", created=0.0))
    assert find_key(connection, "0f3a") == record and find_key(connection, "nobody") is None
    assert [key.id for key in all_keys(connection)] == ["00ff", "0f3a"]
    assert [revoke_key(connection, key_id) for key_id in ("0f3a", "0f3a", "nobody")] == [True, False, False]
    found = find_key(connection, "0f3a")
    assert found is not None and found.revoked is not None and found._replace(revoked=None) == record


def test_two_keys_may_have_a_robot_of_the_same_id(connection: Connection) -> None:
    add = partial(ROBOTS.add, connection, name="arm", bounds=WIDE)
    assert [add(key, content=content(key), owner=key) for key in ("one", "two", "")] == ["added"] * 3
    assert [ROBOTS.find(connection, name, "arm") for name in ("one", "two", "three")] == [
        content("one"),
        content("two"),
        content(""),
    ]
    assert [len(ROBOTS.behind(connection, name, "", 10)) for name in ("one", "three")] == [1, 1]
    assert ROBOTS.delete(connection, "one", "arm", "one") == "deleted"
    assert ROBOTS.find(connection, "one", "arm") == content("")


def test_one_client_fills_no_more_than_its_share_and_deletes_what_it_added_only(connection: Connection) -> None:
    """Any client could take all 1,000 places in 7 s, or delete any robot."""
    add = partial(ROBOTS.add, connection, "", content=content("x"), bounds=WIDE._replace(ids_of_owner=2))
    assert [add(robot_id, owner="one") for robot_id in "abc"] == ["added", "added", "too_many"]
    assert add("c", owner="other") == "added"
    assert [ROBOTS.delete(connection, "", robot_id, "other") for robot_id in "ac"] == ["of_another", "deleted"]
    assert ROBOTS.delete(connection, "", "a", "one") == "deleted"
    assert add("c", owner="one") == "added"


def test_one_client_fills_no_more_than_its_share_of_the_bytes(connection: Connection) -> None:
    add = partial(ROBOTS.add, connection, "", bounds=WIDE._replace(size_of_owner=560))
    assert add("a", content("x", 300), "one") == "added"
    assert add("b", content("x", 300), "one") == "added"  # the same content takes no more
    assert add("c", content("y", 300), "one") == "too_many"
    assert add("c", content("y", 300), "other") == "added"
    assert add("d", content("y", 300), "one") == "too_many"  # it would be one of its own
    assert add("d", content("z", 200), "one") == "added"


def test_the_bytes_of_all_robots_are_bounded(connection: Connection) -> None:
    """100 robots of 4 MB took 382 MB of the server."""
    add = partial(ROBOTS.add, connection, "", owner="me", bounds=WIDE)
    assert add("a", content("x", 600)) == "added"
    assert add("b", content("y", 600)) == "full"
    assert add("b", content("x", 600)) == "added"  # the same content takes no more
    assert ROBOTS.delete(connection, "", "a", "me") == ROBOTS.delete(connection, "", "b", "me") == "deleted"
    assert add("b", content("y", 600)) == "added"


def scene(digest: str, size: int = 0) -> SceneContent:
    return SceneContent(digest, b"x" * size, b'{"margin":0.0}')


def test_an_id_stands_for_another_scene_from_then_on(connection: Connection) -> None:
    """The store deletes unreferenced content; it refuses the second of two concurrent changes."""
    add = partial(SCENES.add, connection, "", bounds=WIDE)
    replace = partial(SCENES.replace, connection, "", "cell", owner="me", bounds=WIDE)
    assert [add(name, content=scene("x"), owner="me") for name in ("cell", "copy")] == ["added", "added"]
    assert replace("x", scene("y")) == "replaced" and SCENES.find(connection, "", "cell") == scene("y")
    assert replace("x", scene("z")) == "changed" and SCENES.find(connection, "", "copy") == scene("x")
    assert replace("y", scene("y")) == "replaced" and SCENES.find(connection, "", "cell") == scene("y")
    assert SCENES.replace(connection, "", "cell", "y", scene("z"), "other", WIDE) == "of_another"
    assert SCENES.replace(connection, "", "none", "y", scene("z"), "me", WIDE) == "unknown"
    assert SCENES.replace(connection, "", "cell", "y", scene("z"), None, WIDE) == "replaced"
    assert sorted(connection.scalars(select(scene_contents.c.digest))) == ["x", "z"]
    assert SCENES.delete(connection, "", "copy", "me") == "deleted"
    assert list(connection.scalars(select(scene_contents.c.digest))) == ["z"]


def test_a_scene_grows_no_further_than_the_share_of_its_client(connection: Connection) -> None:
    bounds = WIDE._replace(size_of_owner=500, ids_of_owner=2)
    add = partial(SCENES.add, connection, "", owner="me", bounds=bounds)
    replace = partial(SCENES.replace, connection, "", "a", owner="me", bounds=bounds)
    assert [add(name, content=scene(name, 200)) for name in "abc"] == ["added", "added", "too_many"]
    assert replace("a", scene("more", 300)) == "too_many"
    assert replace("a", scene("other", 250)) == "replaced"  # its own bytes of before do not count
    assert replace("other", scene("b", 200)) == "replaced"  # the same as another one takes no more
    assert SCENES.replace(connection, "", "a", "b", scene("most", 999), None, WIDE) == "full"


def test_a_scene_shrinks_where_all_bytes_are_taken(connection: Connection) -> None:
    """The freed bytes count, unless another id or a batch still needs the content."""
    add = partial(SCENES.add, connection, "", owner="me", bounds=WIDE)
    assert [add("a", content=scene("a", 600)), add("b", content=scene("b", 300))] == ["added"] * 2
    full = WIDE._replace(size=scene("a", 600).size + scene("b", 300).size)
    replace = partial(SCENES.replace, connection, "", owner="me", bounds=full)
    assert replace("a", "a", scene("more", 601)) == "full"
    assert replace("a", "a", scene("as_large", 600)) == "replaced"
    assert replace("a", "as_large", scene("less", 590)) == "replaced"
    assert replace("a", "less", scene("less", 590)) == "replaced"
    assert SCENES.add(connection, "", "copy", scene("less", 590), "me", full) == "added"
    assert replace("a", "less", scene("least", 100)) == "full"  # the copy needs what was
    assert replace("a", "less", scene("b", 300)) == "replaced"
    arrival = begin_batch(connection, "me", None, "engine", BatchBounds(1, 1, 10**6))
    assert isinstance(arrival, Arrival)
    append_items(connection, arrival.number, 0, [NewItem(b"", None, "copy", 10.0)], "")
    assert replace("copy", "less", scene("least", 100)) == "full"  # the batch needs what was
    connection.execute(delete(items))
    assert replace("copy", "less", scene("least", 100)) == "replaced"
    assert sorted(connection.scalars(select(scene_contents.c.digest))) == ["b", "least"]


def test_settings_keep_the_password_to_themselves() -> None:
    settings = Settings(database_url="postgresql://me:secret@somewhere/planner")  # type: ignore[arg-type]
    assert "secret" not in repr(settings)


def test_the_database_is_not_asked_for_robots_of_the_catalogue() -> None:
    asked: list[str] = []

    class MadeUpDatabase:
        async def read(self, work: Any, namespace: str, robot_id: str) -> None:
            asked.append(robot_id)

    class MadeUpPool:
        async def run(self, task: Any, kind: Any, hold: Any) -> Reply:
            return Reply(200 if b"ur5e" in task.body else 404, "application/json", b"")

    service = SimpleNamespace(
        settings=Settings(), database=MadeUpDatabase(), pool=MadeUpPool(), catalogue=set[str](), engine=None
    )

    async def post(robot_id: str) -> None:
        body = [{"type": "http.request", "body": json.dumps({"robot": robot_id}).encode(), "more_body": False}]

        async def receive() -> Any:
            return body.pop() if body else await asyncio.sleep(10.0)

        app = SimpleNamespace(state=SimpleNamespace(service=service))
        state = {
            "share": Traffic(10**6).share(""),
            "arrived": time.monotonic(),
            "client": Client("127.0.0.1"),
        }
        headers = [(b"content-type", b"application/json")]
        scope = {"type": "http", "method": "POST", "path": "/", "headers": headers, "app": app, "state": state}
        request = Request(scope, receive)
        await get_reply(request, "plan_trajectory", await read_body(request))

    async def three_times() -> None:
        for _ in range(3):
            await post("ur5e")
            await post("nobody")

    asyncio.run(three_times())
    assert asked == ["ur5e", "nobody", "nobody", "nobody"]


@pytest.mark.parametrize("damage", ["nothing", "other bytes", "no bytes"])
def test_a_service_whose_database_cannot_be_read_is_not_ready(tmp_path: Path, damage: str) -> None:
    """Open connections still have the lost content of the file in memory."""
    with made_up_service(data_directory=tmp_path) as client:
        assert client.get("/v1/robots").status_code == 200
        file = tmp_path / FILE_NAME
        if damage != "nothing":
            file.write_bytes(b"robot" * 10_000 if damage == "other bytes" else b"")
            file.with_name(f"{FILE_NAME}-wal").write_bytes(b"")
        answer = client.get("/readyz")
        expected = (200, "ready") if damage == "nothing" else (503, "database_unavailable")
        assert (answer.status_code, answer.json()["status"]) == expected
        assert client.get("/livez").status_code == 200


@pytest.mark.large_only
def test_nobody_else_reads_the_file(tmp_path: Path) -> None:
    """It was for all users of the machine to read."""
    with made_up_service(data_directory=tmp_path) as client:
        answer = client.get("/v1/robots")
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        modes = {file.name: file.stat().st_mode & 0o777 for file in tmp_path.glob(f"{FILE_NAME}*")}
        assert {modes[FILE_NAME + suffix] for suffix in ("", "-wal", "-shm")} == {0o600}


def test_the_files_of_a_former_version_are_for_their_owner_from_the_next_start_on(tmp_path: Path) -> None:
    """A service left them readable for all users of the machine, and the next one did not change that."""
    names = [FILE_NAME + suffix for suffix in ("", "-lock", "-wal", "-shm")]
    holder = make_engine(sqlite_url(tmp_path))
    with holder.connect() as connection:  # another process of the service, which keeps the files beside it alive
        connection.exec_driver_sql("CREATE TABLE kept (id INTEGER)")
        connection.commit()
        for name in names:
            (tmp_path / name).chmod(0o644)
        other = make_engine(sqlite_url(tmp_path)).execution_options(reads=True)
        with other.connect() as looking:
            assert looking.exec_driver_sql("SELECT count(*) FROM kept").scalar() == 0
        assert {name: (tmp_path / name).stat().st_mode & 0o777 for name in names} == dict.fromkeys(names, 0o600)
        other.dispose()
    holder.dispose()
