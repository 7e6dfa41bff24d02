"""Random requests over HTTP: none fails, and no enforced limit of an answer is broken.

CI tries 600, which takes 80 s of processor time; a release ten times as many, `TEST_SIZE=soak`.
"""

from __future__ import annotations

import json
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
import pytest

from planner.robots import load_robot
from tests.api.made_up_service import made_up_service
from tests.api.random_requests.judged import holds
from tests.api.random_requests.made_up import Requests
from tests.sizes import SIZE

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx

ROBOTS = ("three_dof_arm", "ngv_refuelling_arm", "date_sorting_arm")
PARTS = range(4)
"""Tests that they are spread over, which can run side by side, each with random numbers of its own."""


@pytest.fixture(scope="module")
def client() -> Iterator[httpx.Client]:
    with made_up_service() as client:
        yield client


@pytest.mark.sized
@pytest.mark.parametrize("part", PARTS)
def test_none_fails_and_no_enforced_limit_is_broken(client: httpx.Client, part: int) -> None:
    """Half of the plans go on to an operation; what is refused says why, and most are not."""
    random, statuses = np.random.default_rng([12, part]), Counter[tuple[str, int]]()
    wanted = SIZE.over_fields // len(PARTS)
    while statuses.total() < wanted:
        robot = load_robot(ROBOTS[int(random.integers(len(ROBOTS)))])
        requests = Requests(robot, random)
        path, body = "plan", requests.plan()
        for _ in range(2):
            url = "/v1/trajectories" if path == "plan" else f"/v1/trajectories/{path}"
            reply = client.post(url, json=body, timeout=60.0)
            statuses[path, reply.status_code] += 1
            said = f"{url} {json.dumps(body)} {reply.text[:500]}"
            assert reply.status_code in (200, 422), said
            if reply.status_code == 422:
                assert reply.json()["code"], said
                break
            try:
                holds(robot, body, reply.json(), random)
            except AssertionError as broken:
                raise AssertionError(said) from broken
            path, body = requests.operation(reply.json())
    if wanted > 100:
        assert statuses["plan", 200] > 0.4 * (statuses["plan", 200] + statuses["plan", 422]), statuses
