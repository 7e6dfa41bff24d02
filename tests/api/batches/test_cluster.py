"""Batches on a Dask cluster of real processes: every request has one result, even if processes are killed."""

from __future__ import annotations

import asyncio
import signal
from typing import TYPE_CHECKING

import pytest

from api.base.settings import Settings
from api.batches import cluster as cluster_module
from api.batches.cluster import ClusterPlanners
from api.batches.cluster_worker import OtherVersion, plan_chunk
from api.batches.engine import Engine
from api.batches.planners import Chunk, ChunkSize
from api.store.claims import Claimed
from api.store.database import Database
from api.telemetry.metrics import Metrics
from tests.api.batches.clusters import Cluster, running_cluster
from tests.api.batches.long_batches import ITEMS, finished, requests, results, sent, undisturbed, wait_for
from tests.api.conftest import RunningService, running_service
from tests.api.requests import joint, plan_request

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

HOPELESS = {
    "robot": "kuka_kr16_2",
    "backend": {"kind": "min_effort"},
    "waypoints": [joint(0.0, -1.5, 1.5, 0.0, 0.5, 0.0), joint(1.5, -1.0, 1.2, 0.3, 0.5, 0.1)],
    "deadline": 0.05,
}
"""What takes a second and more."""


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    with running_cluster(tmp_path, workers=2) as cluster:
        yield cluster


@pytest.fixture
def service(cluster: Cluster, tmp_path: Path) -> Iterator[RunningService]:
    settings = {"scheduler": cluster.address, "data_directory": tmp_path, "workers": 1}
    with running_service(tmp_path / "log.jsonl", **settings) as service:
        yield service


@pytest.mark.large_only
def test_what_is_killed_in_the_middle_loses_nothing(cluster: Cluster, service: RunningService, tmp_path: Path) -> None:
    """A planning process, a machine, the scheduler and the service are killed one after the other during a batch."""
    location = sent(service, requests(ITEMS))
    wait_for(service, location, ITEMS // 10)
    for process in cluster.planning_processes("worker_0"):
        process.send_signal(signal.SIGKILL)
    wait_for(service, location, ITEMS // 5)
    cluster.kill("worker_0")
    wait_for(service, location, 3 * ITEMS // 10)
    cluster.start_worker("worker_0")
    cluster.kill("scheduler")
    cluster.start_scheduler()
    cluster.wait_joined("worker_1", times=2)
    wait_for(service, location, 2 * ITEMS // 5)
    service.process.kill()
    service.process.wait()
    settings = {"scheduler": cluster.address, "data_directory": tmp_path, "workers": 1}
    with running_service(tmp_path / "again.jsonl", **settings) as again:
        assert 0 < finished(again, location) < ITEMS
        assert results(again, location) == undisturbed()


@pytest.mark.large_only
def test_a_request_that_does_not_end_costs_itself_and_not_the_machine(
    cluster: Cluster, service: RunningService
) -> None:
    asked = requests(20)
    asked[7] = asked[13] = HOPELESS
    found = results(service, sent(service, asked))
    assert [result["index"] for result in found if result["status"] != "planned"] == [7, 13]
    assert {found[index]["status"] for index in (7, 13)} == {"deadline_exceeded"}
    assert all(process.poll() is None for process in cluster.processes.values())


@pytest.mark.large_only
def test_batches_wait_for_a_cluster_that_is_not_there_yet(tmp_path: Path) -> None:
    cluster = Cluster(tmp_path)
    with running_service(tmp_path / "log.jsonl", scheduler=cluster.address, workers=1) as service:
        location = sent(service, requests(3))
        assert service.post("/v1/trajectories", plan_request()).status_code == 200  # by the service's own worker
        assert finished(service, location) == 0
        cluster.start_scheduler()
        cluster.start_worker("late")
        assert [result["status"] for result in results(service, location)] == ["planned"] * 3
        assert service.client.delete(location).status_code == 204
    for process in cluster.processes.values():
        process.terminate()
        process.wait(20.0)


def test_chunks_have_as_many_requests_as_take_a_second() -> None:
    assert ClusterPlanners("tcp://127.0.0.1:1").chunk_size == 1  # nothing is known
    size = ChunkSize(cluster_module.CHUNK_SECONDS, cluster_module.MOST_CHUNKED)
    for seconds, expected in ((0.02, 50), (1e-9, cluster_module.MOST_CHUNKED), (4.0, 1)):
        sizes = [size.learn(seconds) for _ in range(30)]
        assert sizes[-1] == expected


def test_a_chunk_has_requests_of_one_batch() -> None:
    """So that it can be given up with its batch."""
    planners = ClusterPlanners("tcp://127.0.0.1:1")
    planners.chunk_size = 3

    async def chunks() -> list[list[tuple[int, int]]]:
        engine = Engine(Database(None), planners, Settings(), Metrics())
        engine._claimed += [claimed(batch, k) for batch, count in ((1, 4), (2, 2), (3, 2)) for k in range(count)]
        engine.forget(2)
        found = []
        while chunk := engine._next_chunk():
            found.append([(item.batch, item.position) for item in chunk])
        return found

    assert asyncio.run(chunks()) == [[(1, 0), (1, 1), (1, 2)], [(1, 3)], [(3, 0), (3, 1)]]


def claimed(batch: int, position: int) -> Claimed:
    return Claimed(batch, str(batch), position, b"", None, None, 10.0)


def test_a_machine_of_another_version_plans_nothing() -> None:
    with pytest.raises(OtherVersion, match="of tomorrow"):
        asyncio.run(plan_chunk("of tomorrow", Chunk([claimed(1, 0)], {})))
