"""A long batch on the service's own workers: each result occurs once despite failures during the batch."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import pytest

from tests.api.batches.long_batches import ITEMS, finished, requests, results, sent, undisturbed, wait_for
from tests.api.conftest import running_service
from tests.api.store.databases import PostgresServer, postgres

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["postgres"]
OUTAGE = 30.0
"""The duration of the database outage, s."""


@pytest.mark.large_only
def test_a_batch_outlives_its_database(postgres: PostgresServer, tmp_path: Path) -> None:
    """The outage of half a minute exceeds every timeout of the service, which refuses requests meanwhile at once."""
    url = postgres.new_database("outage")
    with running_service(tmp_path / "log.jsonl", database_url=url, workers=1) as service:
        location = sent(service, requests(ITEMS))
        wait_for(service, location, ITEMS // 10)
        postgres.stop()
        end = time.monotonic() + OUTAGE
        while time.monotonic() < end:
            asked = service.client.get(location)
            assert (asked.status_code, asked.json()["code"]) == (503, "database_unavailable")
            assert service.client.get("/livez").status_code == 200
            time.sleep(1.0)
        postgres.start()
        assert finished(service, location) < ITEMS
        assert results(service, location) == undisturbed()


@pytest.mark.large_only
def test_a_batch_outlives_its_workers(tmp_path: Path) -> None:
    with running_service(tmp_path / "log.jsonl") as service:
        location = sent(service, requests(ITEMS))
        for share in (0.1, 0.2, 0.3, 0.4):
            wait_for(service, location, share * ITEMS)
            for worker in service.workers():
                worker.kill()
        assert finished(service, location) < ITEMS
        assert results(service, location) == undisturbed()


@pytest.mark.large_only
def test_a_batch_outlives_its_service(tmp_path: Path) -> None:
    """It is killed and started again, three times."""
    settings = {"data_directory": tmp_path, "workers": 1}
    location = ""
    for count in range(4):
        with running_service(tmp_path / f"log{count}.jsonl", **settings) as service:
            if not location:
                location = sent(service, requests(ITEMS))
            before = finished(service, location)
            assert before < ITEMS
            if count == 3:
                assert results(service, location) == undisturbed()
                return
            wait_for(service, location, before + ITEMS // 10)
            service.process.kill()
            service.process.wait()
