"""Shared answers: simultaneous equal requests are computed once, later ones get the stored answer."""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from starlette.requests import Request

from api.base.byte_budget import Traffic
from api.base.codings import IDENTITY, Coding
from api.base.errors import DeadlineExceeded, InternalError, Overloaded
from api.base.settings import Settings
from api.http.dependencies import Body
from api.http.replies import get_reply
from api.http.shared_answers import OVERHEAD, SharedAnswers
from api.http.transport.shedding import Shedding
from api.pool.messages import Reply
from api.store.clients import Client
from api.telemetry.metrics import Metrics
from tests.api.made_up_service import made_up_service
from tests.api.operations import OPERATIONS
from tests.api.requests import dh_joint, dh_robot, plan_request

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from tests.api.conftest import RunningService

PLAN, FORWARD = "/v1/trajectories", "/v1/kinematics/forward"
SHARED = [operation for operation in OPERATIONS if operation.shared]
ROOM = 100_000


class Work:
    """Work that ends on a signal and counts its starts."""

    def __init__(self, body: bytes = b"answer", status: int = 200) -> None:
        self.reply = Reply(status, "text/plain", body, timings={"plan": 1.0})
        self.begun = 0
        self.given_up = 0
        self.may_end = asyncio.Event()
        self.refusals: list[Exception] = []

    async def __call__(self, hold: Callable[[int], None]) -> Reply:
        self.begun += 1
        try:
            await self.may_end.wait()
        except asyncio.CancelledError:
            self.given_up += 1
            raise
        hold(len(self.reply.body))
        if self.refusals:
            raise self.refusals.pop(0)
        return self.reply


def run(test: Callable[[SharedAnswers], Awaitable[None]], room: int = ROOM) -> None:
    async def with_answers() -> None:
        traffic = Traffic(10**9)
        await test(SharedAnswers(traffic, room, Metrics()))
        assert traffic.held == 0

    asyncio.run(with_answers())


def ask(answers: SharedAnswers, work: Work, tag: str = "x", seconds: float = 60.0) -> asyncio.Task[Reply]:
    return asyncio.create_task(answers.answer(tag, time.monotonic() + seconds, "", work))


async def a_moment() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


def test_what_many_ask_at_once_is_computed_once() -> None:
    async def test(answers: SharedAnswers) -> None:
        work = Work()
        asked = [ask(answers, work) for _ in range(20)]
        other = ask(answers, other_work := Work(b"other"), "y")
        await a_moment()
        assert (work.begun, other_work.begun) == (1, 1)
        work.may_end.set()
        other_work.may_end.set()
        assert {reply.body for reply in await asyncio.gather(*asked)} == {b"answer"}
        assert (await other).body == b"other"

    run(test)


def test_who_hangs_up_takes_nothing_from_those_who_wait() -> None:
    async def test(answers: SharedAnswers) -> None:
        work = Work()
        first, second, third = (ask(answers, work) for _ in range(3))
        await a_moment()
        first.cancel()
        third.cancel()
        await a_moment()
        work.may_end.set()
        assert (await second).body == b"answer"
        assert (work.begun, work.given_up) == (1, 0)

    run(test)


def test_what_nobody_waits_for_is_given_up_and_begun_anew_for_who_comes_next() -> None:
    async def test(answers: SharedAnswers) -> None:
        work = Work()
        asked = [ask(answers, work) for _ in range(3)]
        await a_moment()
        for one in asked:
            one.cancel()
        newcomer = ask(answers, work)  # before the work has noticed
        await a_moment()
        assert (work.begun, work.given_up) == (2, 1)
        work.may_end.set()
        assert (await newcomer).body == b"answer"

    run(test)


@pytest.mark.parametrize("refusal", [Overloaded("full"), DeadlineExceeded("late")], ids=["overloaded", "late"])
def test_those_who_wait_for_one_that_is_refused_ask_for_themselves(refusal: Exception) -> None:
    async def test(answers: SharedAnswers) -> None:
        work = Work()
        work.refusals = [refusal]
        asked = [ask(answers, work) for _ in range(4)]
        await a_moment()
        work.may_end.set()
        replies = await asyncio.gather(*asked, return_exceptions=True)
        assert replies[0] is refusal
        assert [reply.body for reply in replies[1:] if isinstance(reply, Reply)] == [b"answer"] * 3
        assert work.begun == 2

    run(test)


def test_what_kills_its_worker_does_so_once_for_all_who_ask_it() -> None:
    async def test(answers: SharedAnswers) -> None:
        work = Work()
        work.refusals = [InternalError("it died")]
        asked = [ask(answers, work) for _ in range(4)]
        work.may_end.set()
        replies = await asyncio.gather(*asked, return_exceptions=True)
        assert [type(reply) for reply in replies] == [InternalError] * 4
        assert work.begun == 1

    run(test)


def test_each_keeps_its_own_deadline() -> None:
    async def test(answers: SharedAnswers) -> None:
        work, late = Work(), Work()
        late.refusals = [DeadlineExceeded("late")]
        late.may_end.set()  # a pool refuses at once what comes after its deadline
        first = ask(answers, work)
        await a_moment()
        with pytest.raises(DeadlineExceeded):
            await ask(answers, late, seconds=0.02)
        work.may_end.set()
        assert (await first).body == b"answer"

    run(test)


def test_good_answers_are_kept_and_others_are_not() -> None:
    async def test(answers: SharedAnswers) -> None:
        good, bad = Work(), Work(status=422)
        for work, tag in ((good, "good"), (bad, "bad")):
            work.may_end.set()
            for _ in range(3):
                assert (await ask(answers, work, tag)).body == b"answer"
        assert (good.begun, bad.begun) == (1, 3)
        assert (await ask(answers, good, "good")).timings == {}

    run(test)


def test_no_more_is_kept_than_there_is_room_for() -> None:
    async def test(answers: SharedAnswers) -> None:
        begun: Counter[str] = Counter()

        async def get(tag: str, size: int) -> None:
            work = Work(b"x" * size)
            work.may_end.set()
            await ask(answers, work, tag)
            begun[tag] += work.begun

        for k in range(50):
            await get(f"{k}", 10_000)
            await get("0", 10_000)  # what is asked for often stays
            assert answers.bytes_kept <= ROOM
        assert begun["0"] == 1
        await get("49", 10_000)
        await get("1", 10_000)
        assert (begun["49"], begun["1"]) == (1, 2)
        await get("large", ROOM // 8)
        await get("large", ROOM // 8)
        assert begun["large"] == 2  # it would push out all others

    run(test)
    assert ROOM // (10_000 + OVERHEAD) > 3


def test_two_keys_share_no_answer_and_clients_without_do() -> None:
    async def test(answers: SharedAnswers) -> None:
        for clients, computed in ((("key:a", "key:b"), 2), (("192.0.2.1", "192.0.2.2"), 1)):
            work, end = Work(), time.monotonic() + 60.0
            under_way = [asyncio.create_task(answers.answer(clients[0], end, client, work)) for client in clients]
            await a_moment()
            assert work.begun == computed
            work.may_end.set()
            await asyncio.gather(*under_way)
            await answers.answer(clients[0], end, clients[1], work)
            assert work.begun == computed

    run(test)


@pytest.mark.parametrize("name", ["key:a", "192.0.2.1"])
def test_a_request_that_joins_another_leaves_its_place_in_the_queue(name: str) -> None:
    async def test(answers: SharedAnswers) -> None:
        shedding, work = Shedding(Settings(workers=1, express_workers=0, queue_size=1), Metrics()), Work()
        pool = SimpleNamespace(run=lambda _task, _kind, hold: work(hold))
        service = SimpleNamespace(pool=pool, answers=answers, metrics=Metrics(), catalogue=set())
        app = SimpleNamespace(state=SimpleNamespace(service=service))
        sender = Client(name, frozenset(), has_key=name.startswith("key:"))
        share = Traffic(10**9).share(name)

        async def receive() -> Any:
            await asyncio.Event().wait()  # the client stays

        def send() -> asyncio.Task[Reply]:
            state = {"client": sender, "share": share, "arrived": time.monotonic(), "place": shedding.enter(name)}
            scope = {"type": "http", "method": "POST", "path": PLAN, "headers": [], "app": app, "state": state}
            body = Body(b"{}", deadline=60.0)
            return asyncio.create_task(get_reply(Request(scope, receive), "plan_trajectory", body, shared=True))

        first = send()
        await a_moment()
        second = send()
        assert not shedding.has_room(name)
        await a_moment()
        assert shedding.has_room(name)
        first.cancel()
        await a_moment()
        work.may_end.set()
        assert (await second).body == b"answer"
        assert work.begun == 1

    run(test)


def test_nothing_is_kept_where_there_is_no_room() -> None:
    async def test(answers: SharedAnswers) -> None:
        work = Work(b"")
        work.may_end.set()
        for _ in range(3):
            await ask(answers, work)
        assert work.begun == 3 and answers.bytes_kept == 0

    run(test, room=0)


def test_whatever_the_answer_follows_from_changes_the_tag() -> None:
    answers = SharedAnswers(Traffic(1), 0, Metrics())
    contents: list[tuple[str, bytes, dict[str, Any]]] = [
        ("plan", b"{}", {}),
        ("plan", b"{} ", {}),
        ("export", b"{}", {}),
        ("plan", b"{}", {"definition": b"one"}),
        ("plan", b"{}", {"definition": b"other"}),
        ("plan", b"{}", {"accept": "text/csv", "format": None}),
        ("plan", b"{}", {"accept": "*/*", "format": None}),
        ("plan", b"{}", {"accept": "*/*", "format": "csv"}),
        ("plan", b"", {"definition": b"one{}"}),
    ]
    codings = [IDENTITY, Coding("gzip"), Coding("gzip", 0), Coding("zstd")]
    tags = [answers.tag(*content, coding) for content in contents for coding in codings]
    assert len(set(tags)) == len(tags)
    assert tags == [answers.tag(*content, coding) for content in contents for coding in codings]
    assert all(tag.startswith('W/"') and tag.endswith('"') and len(tag) == 68 for tag in tags)


@pytest.mark.long_table
@pytest.mark.parametrize("operation", SHARED, ids=lambda operation: operation.id)
def test_only_get_answers_304_to_a_client_that_has_the_answer(service: RunningService, operation: Any) -> None:
    kept = {"scenes": "kept_scene", "projects": "kept_project"}.get(operation.tag, "three_dof_arm")
    if kept == "kept_scene":
        assert service.post("/v1/scenes", {"id": kept}).status_code in {200, 201}
    if kept == "kept_project":
        assert service.client.put(f"/v1/projects/{kept}", json={}).status_code in {200, 201}
    path = operation.path_of(kept)
    query = {"format": "csv"} if operation.id == "export_trajectory" else None
    body = next(iter(operation.examples.values()), None)
    first = service.client.request(operation.method, path, json=body, params=query)
    assert first.status_code == 200, first.text
    tag = first.headers["ETag"]
    headers = {"If-None-Match": f'"another", {tag}'}
    again = service.client.request(operation.method, path, json=body, params=query, headers=headers)
    expected = (304, b"") if operation.method == "GET" else (200, first.content)
    assert (again.status_code, again.content, again.headers["ETag"]) == (*expected, tag)
    stale = {"If-None-Match": '"another"'}
    changed = service.client.request(operation.method, path, json=body, params=query, headers=stale)
    assert (changed.status_code, changed.content, changed.headers["ETag"]) == (200, first.content, tag)
    if kept in {"kept_scene", "kept_project"}:
        service.client.delete(path)


def test_an_answer_is_computed_afresh_where_that_is_asked(service: RunningService) -> None:
    request = plan_request(seed=4711)
    first, kept = (service.post(PLAN, request) for _ in range(2))
    afresh = service.post(PLAN, request, headers={"Cache-Control": "no-cache"})
    assert first.content == kept.content == afresh.content
    assert ["plan" in answer.headers["Server-Timing"] for answer in (first, kept, afresh)] == [True, False, True]
    refused = service.post(PLAN, plan_request(waypoints=[]))
    assert "ETag" not in refused.headers


@pytest.mark.large_only
def test_a_robot_that_has_become_another_gets_other_answers() -> None:
    asked = {"robot": "planar_arm", "positions": [[0.0, 0.0]]}
    with made_up_service() as client:
        tags, reaches = [], []
        for reach in (0.3, 0.5, 0.3):
            assert client.post("/v1/robots", json=dh_robot(joints=[dh_joint(), dh_joint(a=reach)])).status_code == 201
            known = {"If-None-Match": tags[-1]} if tags else {}
            answer = client.post(FORWARD, json=asked, headers=known)
            reaches.append(answer.json()["poses"][0]["position"][0])
            described = client.get("/v1/robots/planar_arm")
            same = client.get("/v1/robots/planar_arm", headers={"If-None-Match": described.headers["ETag"]})
            assert (described.status_code, same.status_code) == (200, 304)
            tags.append(answer.headers["ETag"])
            assert client.delete("/v1/robots/planar_arm").status_code == 204
            assert client.post(FORWARD, json=asked, headers={"If-None-Match": tags[-1]}).status_code == 404
        assert reaches == pytest.approx([0.7, 0.9, 0.7])
        assert tags[0] == tags[2] != tags[1]
