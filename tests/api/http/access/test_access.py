"""Access to the service: required keys, allowances of keys, and permitted web pages."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner

from api.base.errors import TooManyRequests
from api.base.settings import Settings
from api.http.access.allowance import Allowance
from api.store.database import Database, sqlite_url
from api.store.quota import Quota
from cli import app
from tests.api.made_up_service import made_up_service

if TYPE_CHECKING:
    from pathlib import Path

EVERYWHERE = "0.0.0.0"  # noqa: S104 - that is what is tested


@pytest.mark.parametrize(
    ("host", "access", "asks"),
    [
        ("127.0.0.1", None, False),
        ("::1", None, False),
        ("localhost", None, False),
        ("127.0.0.1", "keys", True),
        (EVERYWHERE, None, True),
        ("::", None, True),
        ("", None, True),
        ("planner.example.com", None, True),
        (EVERYWHERE, "open", False),
    ],
)
def test_keys_are_asked_for_where_others_can_reach_the_service(
    host: str, access: Any, asks: bool, tmp_path: Path
) -> None:
    assert Settings(host=host, access=access, data_directory=tmp_path).asks_for_keys == asks


def test_a_service_that_nobody_could_have_a_key_for_does_not_start() -> None:
    result = CliRunner().invoke(app, ["serve", "--host", EVERYWHERE])
    assert result.exit_code == 2
    assert "PLANNER_ACCESS=open" in " ".join(result.stderr.split())


def test_requests_come_back_evenly() -> None:
    allowance = Allowance(requests=60, concurrent=100, now=0.0)
    granted = [granted_at(allowance, 0.001 * k) for k in range(100)]
    assert sum(granted) == 60 and all(granted[:60])
    assert not granted_at(allowance, 0.9)
    assert granted_at(allowance, 1.05)
    assert allowance.headers() == {"RateLimit-Limit": "60", "RateLimit-Remaining": "0", "RateLimit-Reset": "60"}
    assert sum(granted_at(allowance, 1e6) for _ in range(100)) == 60  # no more than a minute's are saved up


def granted_at(allowance: Allowance, now: float) -> bool:
    try:
        allowance.enter(now)
    except TooManyRequests as refusal:
        wait = int(refusal.headers["Retry-After"])
        assert wait == 1  # as many as there are seconds in a minute: each comes back after one
        return False
    allowance.leave()
    return True


def test_so_many_requests_are_under_way_at_once() -> None:
    allowance = Allowance(requests=100, concurrent=2, now=0.0)
    allowance.enter(0.0)
    allowance.enter(0.0)
    assert not granted_at(allowance, 0.0)
    allowance.leave()
    assert granted_at(allowance, 0.0)


def test_services_share_what_a_key_may_send_in_a_day(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each hears of the other's requests when it writes its own; a new day begins at midnight, whatever happened."""
    now = 86400.0 * 20_000 + 100.0
    monkeypatch.setattr("api.store.quota.time", SimpleNamespace(time=lambda: now, monotonic=lambda: now))

    async def granted(quota: Quota, count: int) -> int:
        left = 0
        for _ in range(count):
            try:
                await quota.take(1)
                left += 1
            except TooManyRequests:
                pass
        return left

    async def run() -> None:
        nonlocal now
        database = Database(sqlite_url(tmp_path))
        database.open()
        one, other = Quota(database, "key", 10), Quota(database, "key", 10)
        assert [await granted(one, 4), await granted(other, 3)] == [4, 3]
        for quota in (one, other):
            await quota.write()
        now += 2.0
        assert await granted(one, 5) == 3
        await one.write()
        assert await granted(other, 5) == 0
        assert await granted(Quota(database, "key", 10), 5) == 0  # a service that starts anew
        assert await granted(Quota(database, "another", 10), 20) == 10
        now += 86400.0 - 200.0
        assert await granted(one, 5) == 0
        now += 100.0
        assert await granted(one, 20) == 10
        database.close()

    asyncio.run(run())


def test_pages_of_other_origins_are_let_in_only_where_the_operator_says_so() -> None:
    origin = {"Origin": "https://cell.example.com"}
    preflight = origin | {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "Authorization"}
    with made_up_service() as client:
        assert not [name for name in client.get("/livez", headers=origin).headers if name.startswith("access-control")]
        assert client.options("/v1/trajectories", headers=preflight).status_code == 405
    with made_up_service(cors_origins="https://cell.example.com, https://office.example.com") as client:
        allowed = client.get("/livez", headers=origin).headers
        assert allowed["access-control-allow-origin"] == "https://cell.example.com"
        assert "RateLimit-Remaining" in allowed["access-control-expose-headers"]
        assert client.options("/v1/trajectories", headers=preflight).status_code == 200
        other = client.get("/livez", headers={"Origin": "https://elsewhere.example.com"}).headers
        assert "access-control-allow-origin" not in other
