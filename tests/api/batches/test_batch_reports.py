"""Reports of batches over HTTP: their content, their independence of other files, and their size."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import orjson
import pytest

from api.pool.messages import Caps, Task
from api.store.items import PLAN_ITEMS, PLANNED, Result, compressed
from api.work.execution import execute
from api.work.tasks import batch_reports
from api.work.tasks.context import TaskContext
from tests.api.conftest import RunningService, wait_until
from tests.api.requests import dh_robot, joint, plan_request
from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.skipif(not (ROOT / "api/built_page/report").is_dir(), reason="the page is not built")
BATCHES = "/v1/batches"
EVIL = "</script><script>alert(1)</script>"
MOST_BYTES = 3e6


def data_of(report: str) -> dict[str, Any]:
    (text,) = re.findall(r'<script type="application/json" id="batch">(.*?)</script>', report, flags=re.DOTALL)
    data: dict[str, Any] = orjson.loads(text)
    return data


def results(service: RunningService, location: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = service.client.get(f"{location}/results", params={"limit": 100}).json()["results"]
    return found


@pytest.fixture(scope="module")
def finished(service: RunningService) -> Iterator[str]:
    """A completed batch of sixteen requests, five of which are refused; two have an added robot."""
    assert service.post("/v1/robots", dh_robot(id="reported_arm")).status_code == 201
    added = {"robot": "reported_arm", "waypoints": [joint(0.1, 0.2), joint(1.0, 0.5, name=EVIL)]}
    three = [plan_request(waypoints=[joint(0.1, 0.2, 0.3), joint(0.3 + 0.01 * k, 0.1, 0.5)]) for k in range(9)]
    planned = [*three, *(plan_request(**added, backend={"kind": kind}) for kind in ("cubic", "quintic"))]
    refused = [*(plan_request(robot=f"nobody_{k}") for k in range(4)), plan_request(waypoints=[])]
    made = service.post(BATCHES, {"requests": [*planned, *refused]})
    assert made.status_code == 202, made.text
    wait_until(lambda: bool(service.client.get(made.headers["Location"]).json()["ended"]))
    yield made.headers["Location"]


def test_a_report_tells_what_came_of_a_batch(service: RunningService, finished: str) -> None:
    answer = service.client.get(f"{finished}/report")
    assert answer.headers["content-type"].startswith("text/html")
    assert answer.headers["cache-control"] == "no-store"
    assert len(answer.content) < MOST_BYTES
    data = data_of(answer.text)
    assert data["batch"] == service.client.get(finished).json()
    figures = data["figures"]
    durations = {result["index"]: result["duration"] for result in results(service, finished) if "duration" in result}
    longest = sorted(durations, key=lambda index: -durations[index])[:5]
    assert [item["duration"] for item in figures["worst"]["longest"]] == [durations[index] for index in longest]
    assert sum(figures["duration"]["counts"]) == sum(figures["ratio"]["counts"]) == 11
    assert sum(figures["seconds"]["counts"]) == 16, "refusals take time, too"
    assert 0.0 < figures["seconds"]["least"] < figures["seconds"]["most"] < 60.0
    examples = {code: [item["position"] for item in found] for code, found in figures["examples"].items()}
    assert examples == {"invalid_request": [15], "unknown_robot": [11, 12, 13]}
    problems = {result["index"]: result["problem"]["detail"] for result in results(service, finished)[11:]}
    assert all(data["problems"][str(index)] == problems[index][:500] for index in (11, 12, 13, 15))


def test_plans_in_a_report_are_those_of_the_batch(service: RunningService, finished: str) -> None:
    text = service.client.get(f"{finished}/report").text
    assert text.count("</script>") == 2, "a name ends no element"
    assert "default-src 'none'" in text
    data = data_of(text)
    named = {item["position"] for items in data["figures"]["worst"].values() for item in items}
    planned = {result["index"]: result["trajectory"] for result in results(service, finished) if "trajectory" in result}
    assert {int(index) for index in data["plans"]} == named & planned.keys()
    for index, shown in data["plans"].items():
        answer, alone = shown["plan"]["answer"], planned[int(index)]
        assert answer["request_hash"] == alone["request_hash"]
        assert answer["certificate"] == alone["certificate"]
        assert answer["samples"]["time"][-1] == pytest.approx(alone["duration"], rel=1e-6)
        assert data["arms"][shown["arm"]]["robot"]["id"] == alone["robot"]
    assert len(data["arms"]) == 2, "each robot is there once"


def test_a_batch_that_is_not_there_has_no_report(service: RunningService) -> None:
    answer = service.client.get(f"{BATCHES}/none/report")
    assert (answer.status_code, answer.json()["code"]) == (404, "unknown_batch")


def test_a_report_keeps_to_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """The report omits each plan that exceeds the remaining size; it includes later, smaller plans."""
    caps = Caps(60.0, 100, 100_000, 640)
    found = []
    for position, moves in enumerate((20, 20, 1)):
        ends = [joint(*[0.1 + 0.02 * k] * 3) for k in range(moves + 1)]
        body = compressed(orjson.dumps(plan_request(waypoints=ends)))
        [saved] = execute(Task(PLAN_ITEMS, "", 0.0, math.inf, arguments={"items": [(body, {})]}), caps).result
        assert saved.code is None, saved.body
        found.append(Result(position, body, None, None, PLANNED, saved.body, saved.result[0]))

    def report(results: list[Result]) -> dict[str, Any]:
        arguments = {"batch": {}, "figures": {}, "results": results, "definitions": {}}
        reply = batch_reports.report_batch(
            TaskContext(Task("get_batch_report", "", 0.0, math.inf, b"", arguments), caps)
        )
        return data_of(reply.body.decode())

    room = len(orjson.dumps(report([found[0], found[2]])))
    assert len(orjson.dumps(report(found[:2]))) > room + 1000
    monkeypatch.setattr(batch_reports, "MOST_BYTES", room)
    assert set(report(found)["plans"]) == {"0", "2"}
