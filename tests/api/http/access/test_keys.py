"""API keys over HTTP: scopes, ownership of robots and batches, and secrecy of the key."""

from __future__ import annotations

import hmac
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import httpx
import pytest
import structlog
from sqlalchemy import delete, insert, update
from typer.testing import CliRunner

from api.base.api_keys import SCOPES, digest_of, id_of, new_key
from api.http.access import access as access_module
from api.store.batches import Arrival, BatchBounds, append_items, begin_batch, open_batch
from api.store.database import make_engine, sqlite_url
from api.store.items import NewItem
from api.store.tables import engines, items
from cli import app
from tests.api.conftest import wait_until
from tests.api.made_up_service import made_up_service
from tests.api.operations import OPERATIONS
from tests.api.requests import dh_robot, plan_request

if TYPE_CHECKING:
    from collections.abc import Iterator

FORWARD = {"robot": "three_dof_arm", "positions": [[0.1, 0.2, 0.3]]}
BATCH = {"requests": [plan_request()]}
NAMES = ("one", "other", "planner", "admin", "revoked")


class Keyed(NamedTuple):
    """A service that requires keys, its keys, and all its answers and logs."""

    client: httpx.Client
    folder: Path
    keys: dict[str, str]
    seen: list[str]
    log: Any

    def ask(self, key: str | None, method: str, path: str, body: Any = None, **headers: str) -> httpx.Response:
        if key is not None:
            headers["Authorization"] = f"Bearer {self.keys.get(key, key)}"
        answer = self.client.request(method, path, json=body, headers=headers)
        self.seen.append(answer.text + str(answer.headers))
        return answer


def planner(*arguments: str) -> Any:
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture(scope="module")
def keyed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Keyed]:
    folder = str(tmp_path_factory.mktemp("keys"))
    scopes = {"planner": ["plan"], "admin": ["admin"]}
    with pytest.MonkeyPatch.context() as patch, structlog.testing.capture_logs() as log:
        patch.setenv("PLANNER_DATA_DIRECTORY", folder)
        patch.setattr("cli.work.stored.configure_logs", lambda _level: None)
        keys = {}
        for name in NAMES:
            options = [option for scope in scopes.get(name, ()) for option in ("--scope", scope)]
            made = planner("keys", "create", name, *options)
            assert made.exit_code == 0, made.output
            keys[name] = made.stdout.strip()
        patch.setattr(access_module, "KNOWN_FOR", 0.0)
        with made_up_service(access="keys", data_directory=folder) as client:
            assert planner("keys", "revoke", str(id_of(keys["revoked"]))).exit_code == 0
            service = Keyed(client, Path(folder), keys, [], log)
            yield service
            for key in keys.values():  # after all that the tests have done
                assert not [text for text in [*service.seen, json.dumps(log, default=str)] if secret_of(key) in text]


def secret_of(key: str) -> str:
    return key.split("_", 2)[2]


def wrong(key: str) -> str:
    """Return a key with another secret."""
    return f"planner_{id_of(key)}_{secret_of(new_key()[1])}"


@pytest.mark.parametrize(
    ("key", "path", "body", "status", "code"),
    [
        (None, "/v1/kinematics/forward", FORWARD, 401, "unauthorized"),
        ("nothing", "/v1/kinematics/forward", FORWARD, 401, "unauthorized"),
        (new_key()[1], "/v1/kinematics/forward", FORWARD, 401, "unauthorized"),
        ("wrong secret", "/v1/kinematics/forward", FORWARD, 401, "unauthorized"),
        ("revoked", "/v1/kinematics/forward", FORWARD, 401, "unauthorized"),
        ("planner", "/v1/batches", BATCH, 403, "forbidden"),
        ("planner", "/v1/robots", dh_robot(id="mine"), 403, "forbidden"),
        ("planner", "/v1/kinematics/forward", FORWARD, 200, None),
        ("one", "/v1/kinematics/forward", FORWARD, 200, None),
        ("admin", "/v1/kinematics/forward", FORWARD, 200, None),
    ],
    ids=["no key", "no such form", "unknown", "wrong secret", "revoked", "batches", "robots", "plan", "all", "admin"],
)
def test_who_may_do_what(keyed: Keyed, key: str | None, path: str, body: Any, status: int, code: str | None) -> None:
    answer = keyed.ask(wrong(keyed.keys["one"]) if key == "wrong secret" else key, "POST", path, body)
    assert answer.status_code == status, answer.text
    assert answer.json().get("code") == code
    assert ("Bearer" in answer.headers.get("WWW-Authenticate", "")) == (status in (401, 403))
    assert ("RateLimit-Remaining" in answer.headers) == (status == 200)


def test_every_operation_asks_for_a_key_but_those_of_the_orchestrator(keyed: Keyed) -> None:
    """Whatever the body: it is not read."""
    open_to_all = {"get_liveness", "get_readiness"}
    for operation in OPERATIONS:
        answer = keyed.ask(None, operation.method, operation.path_of("x"))
        assert (answer.status_code == 401) == (operation.id not in open_to_all), operation.id
        assert (operation.scope is None) == (operation.id in open_to_all)
    assert keyed.client.get("/openapi.json").json()["components"]["securitySchemes"]["key"]["scheme"] == "bearer"
    basic = keyed.client.get("/v1/robots", headers={"Authorization": "Basic " + keyed.keys["one"]})
    assert basic.status_code == 401


def test_each_change_has_a_line_that_says_who_did_it(keyed: Keyed) -> None:
    before = len(keyed.log)
    for path, body in (("/v1/robots", one_link("audited", 1.0)), ("/v1/scenes", {"id": "audited", "objects": []})):
        assert keyed.ask("one", "POST", path, body).status_code == 201
    assert keyed.ask("one", "PATCH", "/v1/scenes/audited", {"objects": []}).status_code == 200
    batch = keyed.ask("one", "POST", "/v1/batches", BATCH).headers["Location"]
    for path in (batch, "/v1/scenes/audited", "/v1/robots/audited"):
        assert keyed.ask("one", "DELETE", path).is_success
    by_requests = {(line["action"], line["client"]) for line in keyed.log[before:] if line["event"] == "audit"}
    of_robots, of_scenes = {"robot_added", "robot_deleted"}, {"scene_added", "scene_changed", "scene_deleted"}
    client = f"key:{id_of(keyed.keys['one'])}"
    assert by_requests == {(action, client) for action in of_robots | of_scenes | {"batch_created", "batch_cancelled"}}
    by_commands = {line["action"] for line in keyed.log if line["event"] == "audit" and line["client"]}
    assert {"key_created", "key_revoked"} <= by_commands


def test_no_answer_tells_a_key_that_another_has_sent_the_same_request(keyed: Keyed) -> None:
    """The second key got the kept answer of the first, without the stages in `Server-Timing`."""
    stages = []
    for name in ("one", "other", "one"):
        timing = keyed.ask(name, "POST", "/v1/trajectories", plan_request()).headers["Server-Timing"]
        stages.append({part.partition(";")[0] for part in timing.split(", ")})
    assert "plan" in stages[0]
    assert stages[1] == stages[0]
    assert stages[2] == {"total"}  # kept for the same key


def test_robots_of_another_are_not_there_and_ids_do_not_collide(keyed: Keyed) -> None:
    shapes = {"one": 1.0, "other": 2.0}
    for name, reach in shapes.items():
        assert keyed.ask(name, "POST", "/v1/robots", one_link("shared_id", reach)).status_code == 201
    for name, reach in shapes.items():
        pose = keyed.ask(name, "POST", "/v1/kinematics/forward", {"robot": "shared_id", "positions": [[0.0]]}).json()
        assert pose["poses"][0]["position"][0] == pytest.approx(reach)
    assert keyed.ask("one", "POST", "/v1/robots", one_link("mine_alone", 3.0)).status_code == 201
    for method, path, body in (
        ("GET", "/v1/robots/mine_alone", None),
        ("DELETE", "/v1/robots/mine_alone", None),
        ("POST", "/v1/kinematics/forward", {"robot": "mine_alone", "positions": [[0.0]]}),
    ):
        assert keyed.ask("other", method, path, body).json()["code"] == "unknown_robot"
    listed = {
        name: [robot["id"] for robot in keyed.ask(name, "GET", "/v1/robots?limit=100").json()["robots"]]
        for name in shapes
    }
    assert {"mine_alone", "shared_id"} <= set(listed["one"])
    assert "mine_alone" not in listed["other"] and listed["other"].count("shared_id") == 1
    batch = keyed.ask("other", "POST", "/v1/batches", {"requests": [one_link_request("shared_id")]})
    found = results_of(keyed, "other", batch.headers["Location"])
    assert found[0]["trajectory"]["waypoints"][0]["pose"]["position"][0] == pytest.approx(2.0)
    assert keyed.ask("one", "DELETE", "/v1/robots/mine_alone").status_code == 204


def test_a_public_robot_is_everybodys_to_use_and_its_owners_to_delete(keyed: Keyed) -> None:
    def reach(name: str) -> Any:
        answer = keyed.ask(name, "POST", "/v1/kinematics/forward", {"robot": "shown", "positions": [[0.0]]})
        return answer.json()["poses"][0]["position"][0] if answer.status_code == 200 else answer.json()["code"]

    public = {"visibility": "public"}
    assert keyed.ask("one", "POST", "/v1/robots", one_link("shown", 1.0) | public).status_code == 201
    assert [reach(name) for name in ("one", "other", "planner")] == pytest.approx([1.0] * 3)
    assert keyed.ask("one", "POST", "/v1/robots", one_link("shown", 1.0) | public).status_code == 200
    assert keyed.ask("other", "POST", "/v1/robots", one_link("shown", 2.0) | public).json()["code"] == "robot_exists"
    assert keyed.ask("other", "POST", "/v1/robots", one_link("shown", 2.0)).status_code == 201
    assert [reach(name) for name in ("one", "other", "planner")] == pytest.approx([1.0, 2.0, 1.0])
    assert keyed.ask("other", "DELETE", "/v1/robots/shown").status_code == 204  # its own
    assert keyed.ask("other", "DELETE", "/v1/robots/shown").json()["code"] == "robot_of_another"
    assert keyed.ask("one", "GET", "/v1/robots/shown").json()["id"] == "shown"
    assert keyed.ask("one", "DELETE", "/v1/robots/shown").status_code == 204
    assert [reach(name) for name in ("one", "other")] == ["unknown_robot"] * 2


def test_scenes_of_another_are_not_there_unless_they_are_public(keyed: Keyed) -> None:
    cells = {name: {"id": "cell", "margin": margin} for name, margin in (("one", 0.01), ("other", 0.02))}
    for name, scene in cells.items():
        assert keyed.ask(name, "POST", "/v1/scenes", scene).status_code == 201
    assert keyed.ask("planner", "POST", "/v1/scenes", cells["one"]).json()["code"] == "forbidden"
    for name, scene in cells.items():
        assert keyed.ask(name, "GET", "/v1/scenes/cell").json()["margin"] == scene["margin"]
    for method, body in (("GET", None), ("PATCH", {"margin": 0.5}), ("DELETE", None)):
        key = "planner" if method == "GET" else "admin"
        assert keyed.ask(key, method, "/v1/scenes/cell", body).json()["code"] == "unknown_scene"
    assert keyed.ask("planner", "POST", "/v1/trajectories", plan_request(scene="cell")).status_code == 404
    assert keyed.ask("one", "PATCH", "/v1/scenes/cell", {"margin": 0.05}).status_code == 200
    assert keyed.ask("other", "GET", "/v1/scenes/cell").json()["margin"] == 0.02
    public = {"id": "hall", "visibility": "public"}
    assert keyed.ask("one", "POST", "/v1/scenes", public).status_code == 201
    assert keyed.ask("planner", "POST", "/v1/trajectories", plan_request(scene="hall")).status_code == 200
    assert [scene["id"] for scene in keyed.ask("planner", "GET", "/v1/scenes").json()["scenes"]] == ["hall"]
    assert keyed.ask("other", "PATCH", "/v1/scenes/hall", {"margin": 1.0}).json()["code"] == "scene_of_another"
    assert keyed.ask("admin", "PATCH", "/v1/scenes/hall", {"margin": 0.0}).status_code == 200
    roadmap, of = "/v1/scenes/hall/roadmap", {"robot": "three_dof_arm", "samples": 2}
    refused = [keyed.ask(name, "POST", roadmap, of).json()["code"] for name in ("planner", "other")]
    assert refused == ["forbidden", "scene_of_another"]
    assert keyed.ask("one", "POST", roadmap, of).status_code == 201
    assert len(keyed.ask("planner", "GET", roadmap).json()["roadmaps"]) == 1
    path = f"{roadmap}?robot=three_dof_arm"
    assert keyed.ask("other", "DELETE", path).json()["code"] == "scene_of_another"
    assert keyed.ask("one", "DELETE", path).status_code == 204
    for name, path in (("one", "hall"), ("one", "cell"), ("other", "cell")):
        assert keyed.ask(name, "DELETE", f"/v1/scenes/{path}").status_code == 204


def one_link(robot_id: str, reach: float) -> dict[str, Any]:
    row = {"kind": "revolute", "theta": 0.0, "d": 0.0, "a": reach, "alpha": 0.0, "velocity": 1.0, "acceleration": 1.0}
    return dh_robot(id=robot_id, joints=[row])


def one_link_request(robot_id: str) -> dict[str, Any]:
    ends = [{"kind": "joint", "position": [angle]} for angle in (0.0, 0.5)]
    return {"robot": robot_id, "waypoints": ends, "backend": {"kind": "cubic"}}


def results_of(keyed: Keyed, key: str, location: str) -> Any:
    wait_until(lambda: keyed.ask(key, "GET", location).json()["status"] == "completed")
    return keyed.ask(key, "GET", f"{location}/results").json()["results"]


def test_batches_of_another_are_not_there(keyed: Keyed) -> None:
    location = keyed.ask("one", "POST", "/v1/batches", BATCH).headers["Location"]
    results_of(keyed, "one", location)
    for method, path in (
        ("GET", ""),
        ("GET", "/results"),
        ("GET", "/results.ndjson"),
        ("GET", "/events"),
        ("DELETE", ""),
    ):
        assert keyed.ask("other", method, location + path).json()["code"] == "unknown_batch"
    batch_id = location.rpartition("/")[2]
    seen = {
        name: batch_id in [batch["id"] for batch in keyed.ask(name, "GET", "/v1/batches").json()["batches"]]
        for name in ("one", "other", "admin")
    }
    assert seen == {"one": True, "other": False, "admin": True}
    assert keyed.ask("admin", "GET", location).status_code == 200
    assert keyed.ask("one", "GET", f"{location}/events").text.count("event: end") == 1
    assert keyed.ask("one", "DELETE", location).status_code == 204


def batch_without_end(folder: Path, key: str) -> str:
    """Return the id of a key's batch whose only request is claimed by another service that never ends."""
    engine = make_engine(sqlite_url(folder))
    with engine.begin() as connection:
        connection.execute(delete(engines).where(engines.c.id == "elsewhere"))
        connection.execute(insert(engines).values(id="elsewhere", seen=time.time() + 1e6))
        batch = begin_batch(connection, f"key:{id_of(key)}", None, "elsewhere", BatchBounds(1000, 1000, 10**9))
        assert isinstance(batch, Arrival)
        append_items(connection, batch.number, 0, [NewItem(b"0", None, None, 10.0)], "")
        connection.execute(update(items).where(items.c.batch == batch.number).values(engine="elsewhere"))
        open_batch(connection, batch.number, "digest")
    engine.dispose()
    return batch.id


@pytest.mark.parametrize("name", ["events", "results.ndjson"])
def test_a_stream_ends_when_its_key_is_revoked(keyed: Keyed, name: str) -> None:
    """It went on for as long as the batch."""
    key = planner("keys", "create", "short-lived").stdout.strip()
    path = f"/v1/batches/{batch_without_end(keyed.folder, key)}"
    streaming = keyed.client.stream("GET", f"{path}/{name}", headers={"Authorization": f"Bearer {key}"}, timeout=30.0)
    with pytest.raises(httpx.RemoteProtocolError), streaming as stream:
        assert stream.status_code == 200
        assert planner("keys", "revoke", str(id_of(key))).exit_code == 0
        for _ in stream.iter_bytes():
            pass
    assert keyed.ask("admin", "DELETE", path).status_code == 204


def test_a_key_may_send_so_many_requests(keyed: Keyed) -> None:
    keyed.keys["slow"] = planner("keys", "create", "slow", "--requests-per-minute", "2").stdout.strip()
    answers = [keyed.ask("slow", "POST", "/v1/kinematics/forward", FORWARD) for _ in range(3)]  # one is computed
    assert [answer.status_code for answer in answers] == [200, 200, 429]
    assert [answer.headers["RateLimit-Remaining"] for answer in answers] == ["1", "0", "0"]
    assert {answer.headers["RateLimit-Limit"] for answer in answers} == {"2"}
    assert answers[-1].json()["code"] == "too_many_requests"
    assert 1 <= int(answers[-1].headers["Retry-After"]) <= 30
    assert keyed.ask("one", "GET", "/v1/limits").status_code == 200


def test_a_key_may_send_so_many_requests_a_day_those_of_batches_among_them(keyed: Keyed) -> None:
    keyed.keys["daily"] = planner("keys", "create", "daily", "--requests-per-day", "6").stdout.strip()
    batch = {"requests": [plan_request(seed=seed) for seed in range(3)]}
    first = keyed.ask("daily", "POST", "/v1/batches", batch)
    assert (first.status_code, first.headers["RateLimit-Remaining"]) == (202, "2")
    refused = keyed.ask("daily", "POST", "/v1/batches", batch)  # it counts as a request that was sent
    assert (refused.status_code, refused.json()["code"]) == (429, "too_many_requests")
    assert keyed.ask("daily", "GET", "/v1/limits").headers["RateLimit-Remaining"] == "0"
    last = keyed.ask("daily", "POST", "/v1/kinematics/forward", FORWARD)
    assert last.status_code == 429 and last.headers["RateLimit-Limit"] == "6"
    assert 0 < int(last.headers["Retry-After"]) == int(last.headers["RateLimit-Reset"]) <= 86400
    assert len(keyed.ask("daily", "GET", "/v1/batches").json().get("batches", [])) == 0  # refused as well
    assert keyed.ask("one", "GET", "/v1/limits").headers["RateLimit-Limit"] == "6000"


@pytest.mark.parametrize("kind", ["unknown", "wrong secret"])
def test_keys_are_compared_in_a_time_that_says_nothing(
    keyed: Keyed, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """Digests of the whole key, of the same length, whether there is such a key or not."""
    compared: list[tuple[str, str]] = []

    def compare(given: str, kept: str) -> bool:
        compared.append((given, kept))
        return original(given, kept)

    original = hmac.compare_digest
    monkeypatch.setattr(hmac, "compare_digest", compare)
    key = new_key()[1] if kind == "unknown" else wrong(keyed.keys["one"])
    assert keyed.ask(key, "GET", "/v1/limits").status_code == 401
    ((given, kept),) = compared
    assert given == digest_of(key) and len(kept) == len(given)
    assert (kept == digest_of(keyed.keys["one"])) == (kind == "wrong secret")


def test_a_key_is_kept_as_a_hash_and_shown_once(keyed: Keyed) -> None:
    listed = planner("keys", "list").stdout
    assert all(str(id_of(key)) in listed for key in keyed.keys.values())
    files = [file.read_bytes() for file in keyed.folder.iterdir()]
    assert any(digest_of(keyed.keys["one"]).encode() in content for content in files)
    for key in keyed.keys.values():
        assert secret_of(key) not in listed
        assert not any(secret_of(key).encode() in content for content in files)


def test_keys_are_listed_by_their_names_with_all_that_they_may_do(keyed: Keyed) -> None:
    """The column of the scopes left no room for that of the names, and was cut off."""
    words = planner("keys", "list").stdout.split()
    assert {"name", "a", "minute", "at", "once", "day", "revoked", *NAMES, *SCOPES} <= set(words)


def test_the_command_line_refuses_what_there_is_not(keyed: Keyed) -> None:
    assert planner("keys", "create", "x", "--scope", "everything").exit_code == 2
    assert planner("keys", "revoke", "000000000000").exit_code == 1
    assert planner("keys", "revoke", str(id_of(keyed.keys["revoked"]))).exit_code == 1


def test_no_key_has_a_form_that_is_not_found_again() -> None:
    for _ in range(200):
        key_id, key = new_key()
        assert id_of(key) == key_id and len(key) == 64
    assert [id_of(text) for text in ("", "planner", "planner__", "planner_ab_x", "x" * 500)] == [None] * 5
