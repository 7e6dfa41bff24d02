"""Batches over HTTP: three notations of bodies, planning in the background, and results while it runs."""

from __future__ import annotations

import json
from base64 import b64decode
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from typing import TYPE_CHECKING, Any
from zipfile import ZipFile

import numpy as np
import pytest

from api.contract.batches import Batch, BatchesAnswer, BatchResultsAnswer
from tests.api.batches.long_batches import slow_requests
from tests.api.conftest import RunningService, wait_until
from tests.api.requests import dh_robot, joint, plan_request
from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

BATCHES = "/v1/batches"

A_MINUTE = {
    "robot": "kuka_kr16_2",
    "waypoints": [
        joint(0.9, -0.9, 1.2, 0.0, 0.8, 0.0),
        joint(-0.9, -0.9, 1.2, 0.0, 0.8, 0.0, motion={"kind": "free", "optimise": "duration", "time_budget": 600.0}),
    ],
    "scene": {
        "objects": [
            {"id": "wall", "shape": {"kind": "box", "size": [0.8, 0.1, 1.6]}, "pose": {"position": [1.3, 0.0, 0.8]}}
        ]
    },
    "deadline": 60.0,
}
"""An optimisation that lasts until its deadline."""


def requests(count: int, **changes: Any) -> list[dict[str, Any]]:
    """Return distinct requests with two back ends."""
    return [
        plan_request(
            waypoints=[joint(0.1, 0.2, 0.3), joint(0.3 + 1e-3 * k, 0.1, 0.5)],
            backend={"kind": ("cubic", "trapezoidal")[k % 2]},
            sample_period=0.05,
            **changes,
        )
        for k in range(count)
    ]


def status(service: RunningService, location: str) -> dict[str, Any]:
    answer: dict[str, Any] = service.client.get(location).json()
    return answer


def complete(service: RunningService, location: str) -> dict[str, Any]:
    wait_until(lambda: status(service, location)["status"] != "running", 60.0)
    return status(service, location)


def results(service: RunningService, location: str, **query: Any) -> list[dict[str, Any]]:
    """Read all results of an ended batch page by page."""
    found, cursor = [], None
    while True:
        page = service.client.get(f"{location}/results", params=query | ({} if cursor is None else {"cursor": cursor}))
        assert page.status_code == 200, page.text
        BatchResultsAnswer.model_validate_json(page.content, strict=True)
        found += page.json()["results"]
        cursor = page.json()["next_cursor"]
        if cursor is None:
            return found


def lines(documents: list[Any]) -> bytes:
    return b"\n".join(json.dumps(document).encode() for document in documents) + b"\n"


@pytest.fixture(scope="module")
def finished(service: RunningService) -> Iterator[str]:
    """A batch of seven requests, two of which cannot be planned, that has been completed."""
    asked = [*requests(5), plan_request(robot="nobody"), plan_request(waypoints=[])]
    made = service.post(BATCHES, {"requests": asked})
    assert made.status_code == 202, made.text
    location = made.headers["Location"]
    assert Batch.model_validate_json(made.content, strict=True).counts.total == 7
    complete(service, location)
    yield location


def test_every_result_is_what_the_request_alone_gets(service: RunningService, finished: str) -> None:
    found = results(service, finished, limit=3)
    assert [result["index"] for result in found] == list(range(7))
    alone = [service.post("/v1/trajectories", request).json() for request in requests(5)]
    assert [result["trajectory"] for result in found[:5]] == alone
    assert [result["status"] for result in found[5:]] == ["unknown_robot", "invalid_request"]
    assert found[6]["problem"]["errors"][0]["pointer"] == "/waypoints"
    assert found[6]["problem"]["instance"] == finished


def test_the_status_counts_and_sums_up(service: RunningService, finished: str) -> None:
    batch = Batch.model_validate_json(service.client.get(finished).content, strict=True)
    assert batch.status == "completed" and batch.ended is not None and batch.rate is batch.remaining_time is None
    assert (batch.counts.planned, batch.counts.refused, batch.counts.waiting) == (5, 2, 0)
    refusals = {refusal.code: (refusal.count, refusal.example) for refusal in batch.summary.refusals}
    assert refusals == {"invalid_request": (1, 6), "unknown_robot": (1, 5)}
    (refused,) = service.client.get(f"{finished}/results?limit=1&cursor=5").json()["results"]
    assert (refused["index"], refused["problem"]["code"]) == (6, "invalid_request")
    durations = [result["trajectory"]["duration"] for result in results(service, finished)[:5]]
    assert batch.summary.duration is not None
    assert (batch.summary.duration.shortest, batch.summary.duration.longest) == (min(durations), max(durations))
    assert batch.summary.duration.mean == pytest.approx(np.mean(durations))
    assert batch.summary.duration.histogram == np.histogram(durations, 20)[0].tolist()
    assert batch.summary.worst_ratio == pytest.approx(1.0, abs=1e-6)  # the fastest that the limits allow


def test_results_come_in_every_form_of_a_plan(service: RunningService, finished: str) -> None:
    (text, *_) = results(service, finished, format="csv")
    alone = service.post("/v1/trajectories?format=csv", requests(1)[0])
    assert (text["content"], text["encoding"]) == (alone.text, "text")
    assert alone.headers["content-type"].startswith(text["media_type"])
    (binary, *_) = results(service, finished, format="npz")
    position = np.load(BytesIO(b64decode(binary["content"])))["position"]
    np.testing.assert_allclose(position[[0, -1]], [[0.1, 0.2, 0.3], [0.3, 0.1, 0.5]], atol=1e-12)
    (refused, *_) = results(service, finished, format="urscript")  # it has three joints
    assert refused["status"] == refused["problem"]["code"] == "unsupported_format"
    unknown = service.client.get(f"{finished}/results.ndjson?format=of_nobody")
    assert (unknown.status_code, unknown.json()["code"]) == (406, "not_acceptable")


def test_results_are_streamed(service: RunningService, finished: str) -> None:
    stream = service.client.get(f"{finished}/results.ndjson")
    assert stream.headers["content-type"].startswith("application/x-ndjson")
    assert [json.loads(line) for line in stream.content.splitlines()] == results(service, finished)


def test_results_come_as_an_archive(service: RunningService, finished: str) -> None:
    answer = service.client.get(f"{finished}/results.zip?format=csv")
    assert answer.headers["content-type"] == "application/zip"
    assert answer.headers["content-disposition"] == f'attachment; filename="{finished.rpartition("/")[2]}.zip"'
    with ZipFile(BytesIO(answer.content)) as archive:
        assert archive.testzip() is None
        planned = [f"{k:06d}.csv" for k in range(5)]
        assert archive.namelist() == [*planned, "000005.problem.json", "000006.problem.json"]
        alone = service.post("/v1/trajectories?format=csv", requests(1)[0])
        assert archive.read("000000.csv") == alone.content
        assert json.loads(archive.read("000005.problem.json"))["code"] == "unknown_robot"
    assert service.client.get(f"{finished}/results.zip?format=csv").content == answer.content
    with ZipFile(BytesIO(service.client.get(f"{finished}/results.zip?format=urscript").content)) as archive:
        assert json.loads(archive.read("000000.problem.json"))["code"] == "unsupported_format"
    with ZipFile(BytesIO(service.client.get(f"{finished}/results.zip").content)) as archive:
        assert archive.namelist()[:1] == ["000000.json"]
    assert service.client.get(f"{finished}/results.zip?format=of_nobody").json()["code"] == "not_acceptable"


def test_a_list_and_lines_and_a_grid_of_the_same_requests_are_the_same(service: RunningService) -> None:
    template = plan_request(sample_period=0.05)
    values = [0.3, 0.4]
    kinds = ["cubic", "quintic"]
    asked = [
        plan_request(waypoints=[joint(0.1, 0.2, 0.3), joint(end, 0.1, 0.5)], backend={"kind": kind}, sample_period=0.05)
        for end in values
        for kind in kinds
    ]
    vary = [{"pointer": "/waypoints/1/position/0", "values": values}, {"pointer": "/backend/kind", "values": kinds}]
    made = [
        service.post(BATCHES, {"requests": asked}),
        service.client.post(BATCHES, content=lines(asked), headers={"Content-Type": "application/x-ndjson"}),
        service.post(BATCHES, {"grid": {"template": template, "vary": vary}}),
    ]
    found = []
    for answer in made:
        assert answer.status_code == 202, answer.text
        complete(service, answer.headers["Location"])
        found.append([result["trajectory"] for result in results(service, answer.headers["Location"])])
    assert found[0] == found[1] == found[2]
    assert [plan["backend"] for plan in found[0]] == kinds * 2


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        ({}, ""),
        ([], ""),
        ({"requests": []}, ""),
        ({"requests": [1]}, "/requests/0"),
        ({"requests": [plan_request()], "more": 1}, ""),
        ({"grid": None}, ""),
        ({"grid": 1}, "/grid"),
        ({"grid": []}, "/grid"),
        ({"grid": {"template": plan_request(), "vary": []}}, "/grid/vary"),
        ({"grid": {"template": plan_request(), "vary": [{"pointer": "/a/b", "values": [1]}]}}, "/grid/vary/0/pointer"),
        (
            {"grid": {"template": {}, "vary": [{"pointer": f"/{k}", "values": list(range(100))} for k in range(16)]}},
            "/grid/vary",
        ),
    ],
    ids=str,
)
def test_a_body_of_no_requests_is_refused(service: RunningService, body: Any, pointer: str) -> None:
    answer = service.post(BATCHES, body)
    assert (answer.status_code, answer.json()["errors"][0]["pointer"]) == (422, pointer), answer.text


@pytest.mark.parametrize(
    ("content", "pointer"),
    [(b"", "/requests"), (b"\n\n", "/requests"), (lines([{}]) + b"{", "/requests/1"), (b"[1]\n", "/requests/0")],
)
def test_lines_of_no_requests_are_refused(service: RunningService, content: bytes, pointer: str) -> None:
    before = service.client.get(BATCHES).json()["batches"][:1]
    answer = service.client.post(BATCHES, content=content, headers={"Content-Type": "application/x-ndjson"})
    assert (answer.status_code, answer.json()["errors"][0]["pointer"]) == (422, pointer), answer.text
    assert service.client.get(BATCHES).json()["batches"][:1] == before  # nothing is left of it


def test_the_same_key_makes_one_batch(service: RunningService) -> None:
    headers = {"Idempotency-Key": "overnight"}
    first, again = (service.post(BATCHES, {"requests": requests(1)}, headers=headers) for _ in range(2))
    assert (first.status_code, again.status_code) == (202, 202)
    assert first.headers["Location"] == again.headers["Location"]
    other = service.post(BATCHES, {"requests": requests(2)}, headers=headers)
    assert (other.status_code, other.json()["code"]) == (409, "conflict")


def test_events_tell_how_far_it_is_and_resume(service: RunningService) -> None:
    example = json.loads((ROOT / "examples" / "batches" / "speeds_and_back_ends.json").read_text())
    location = service.post(BATCHES, example).headers["Location"]

    def events(**headers: str) -> list[tuple[int, str, dict[str, Any]]]:
        text = service.client.get(f"{location}/events", headers=headers).text
        fields = [dict(line.split(": ", 1) for line in event.splitlines()) for event in text.strip().split("\n\n")]
        return [(int(event["id"]), event["event"], json.loads(event["data"])) for event in fields]

    heard = events()
    assert [name for _, name, _ in heard] == ["progress"] * (len(heard) - 1) + ["end"]
    assert [number for number, _, _ in heard] == sorted({number for number, _, _ in heard})
    assert heard[-1][0] == heard[-1][2]["counts"]["planned"] == 30
    assert [name for _, name, _ in events(**{"Last-Event-ID": "30"})] == ["end"]


def test_batches_are_listed_the_newest_first(service: RunningService, finished: str) -> None:
    newest = service.post(BATCHES, {"requests": requests(1)}).headers["Location"]
    page = BatchesAnswer.model_validate_json(service.client.get(f"{BATCHES}?limit=1").content, strict=True)
    assert [f"{BATCHES}/{batch.id}" for batch in page.batches] == [newest]
    behind = service.client.get(BATCHES, params={"cursor": page.next_cursor}).json()
    ids = [batch["id"] for batch in behind["batches"]]
    assert finished.rpartition("/")[2] in ids and newest.rpartition("/")[2] not in ids


@pytest.mark.parametrize("path", ["", "/results", "/results.ndjson", "/events"])
def test_an_unknown_batch_is_a_problem(service: RunningService, path: str) -> None:
    answer = service.client.get(f"{BATCHES}/nothing{path}")
    assert (answer.status_code, answer.json()["code"]) == (404, "unknown_batch")


@pytest.mark.large_only
def test_a_service_that_is_killed_goes_on_when_it_is_back(
    start_service: Callable[..., RunningService], tmp_path: Path, service: RunningService
) -> None:
    """Every result occurs once and equals the answer to the single request; added robots work, too."""
    settings = {"workers": 1, "data_directory": tmp_path / "data"}
    planar = plan_request(robot="planar_arm", waypoints=[joint(0.0, 0.1), joint(0.5, 0.2)], sample_period=0.05)
    asked = [*requests(80), planar, *requests(80), *slow_requests(6)]  # the slow ones are not done before it is killed
    first = start_service(**settings)
    content = first.post("/v1/robots", dh_robot()).json()["content"]
    location = first.post(BATCHES, {"requests": asked}).headers["Location"]
    wait_until(lambda: status(first, location)["counts"]["planned"] > 20)
    first.process.kill()
    first.process.wait()
    second = start_service(**settings)
    counts = status(second, location)["counts"]
    assert counts["planned"] < counts["total"]
    assert second.client.get("/v1/robots/planar_arm").json()["content"] == content
    assert second.client.delete("/v1/robots/planar_arm").status_code == 204  # the batch has its own
    assert complete(second, location)["counts"] == {"total": 167, "waiting": 0, "planned": 167, "refused": 0}
    found = results(second, location, limit=1000)
    assert [result["index"] for result in found] == list(range(167))
    other = service.post(BATCHES, {"requests": requests(80)}).headers["Location"]
    complete(service, other)
    undisturbed = [result["trajectory"] for result in results(service, other, limit=1000)]
    assert [result["trajectory"] for result in found[:161]] == [*undisturbed, found[80]["trajectory"], *undisturbed]
    assert found[80]["trajectory"]["samples"]["position"][-1] == pytest.approx([0.5, 0.2])


def test_clients_that_come_at_once_with_one_key_get_one_batch(service: RunningService) -> None:
    headers = {"Idempotency-Key": "at once"}
    with ThreadPoolExecutor(4) as threads:
        body = {"requests": requests(50)}
        answers = list(threads.map(lambda _: service.post(BATCHES, body, headers=headers), range(4)))
    made = {answer.headers["Location"] for answer in answers if answer.status_code == 202}
    assert len(made) == 1
    assert {answer.json()["code"] for answer in answers if answer.status_code != 202} <= {"conflict"}


@pytest.mark.large_only
def test_a_batch_leaves_a_worker_to_other_requests(service: RunningService) -> None:
    """Slow plans use one of two workers: nine plans of milliseconds do not each wait for one of seconds."""
    location = service.post(BATCHES, {"requests": slow_requests(16)}).headers["Location"]
    try:
        wait_until(lambda: status(service, location)["counts"]["planned"] > 0)
        before = status(service, location)["counts"]["planned"]
        answers = [service.post("/v1/trajectories", request) for request in requests(9)]
        assert {answer.status_code for answer in answers} == {200}
        after = status(service, location)
        assert after["status"] == "running" and after["counts"]["planned"] - before < 4
    finally:
        service.client.delete(location)


@pytest.mark.large_only
def test_a_cancelled_batch_takes_no_worker_any_more(service: RunningService) -> None:
    """Each plan takes a minute: the service aborts the running plan, then plans the requests behind the batch."""
    wait_until(lambda: service.busy_workers() == 0)
    location = service.post(BATCHES, {"requests": [A_MINUTE] * 4}).headers["Location"]
    wait_until(lambda: service.busy_workers() == 1)
    assert service.client.delete(location).status_code == 204
    batch = status(service, location)
    assert (batch["status"], batch["counts"]["waiting"]) == ("cancelled", 4)
    wait_until(lambda: service.busy_workers() == 0, 20.0)
    behind = service.post(BATCHES, {"requests": requests(3)}).headers["Location"]
    wait_until(lambda: status(service, behind)["status"] == "completed", 20.0)
    assert status(service, location) == batch and results(service, location) == []


@pytest.mark.large_only
def test_a_cancelled_batch_keeps_what_is_done(service: RunningService) -> None:
    location = service.post(BATCHES, {"requests": requests(2) + slow_requests(8)}).headers["Location"]
    wait_until(lambda: status(service, location)["counts"]["planned"] >= 2)
    assert service.client.delete(location).status_code == 204
    batch = status(service, location)
    assert batch["status"] == "cancelled" and batch["counts"]["waiting"] > 0
    assert len(results(service, location)) == batch["counts"]["planned"]
    assert service.post("/v1/trajectories", plan_request()).status_code == 200
    assert service.client.delete(location).status_code == 204  # again: it is so already
    assert status(service, location) == batch
    assert service.client.delete(location, params={"forget": "true"}).status_code == 204
    assert service.client.get(location).status_code == 404
