"""Random requests over HTTP, over all fields: no failure, no exceeded limit, no unproved answer.

CI tries 5,000; `TEST_FIELDS=50000` so many. `python -m tests.api.random_requests 0 1000` goes on after a failure.
"""

from __future__ import annotations

import resource
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from api.work.tasks.context import TASKS
from tests.api.made_up_service import made_up_service
from tests.api.random_requests.conversation import Conversation
from tests.sizes import OVER_FIELDS

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx

PARTS = range(8)
"""Number of parallel tests that share the requests."""


@pytest.fixture(scope="module")
def client() -> Iterator[httpx.Client]:
    with made_up_service() as client:
        yield client


@pytest.mark.sized
@pytest.mark.parametrize("part", PARTS)
def test_none_fails_and_what_is_returned_holds(client: httpx.Client, part: int) -> None:
    """Plans continue with an operation, some refusals with a remedy; few requests are refused, each with a reason."""
    statuses, number = Counter[tuple[str, str]](), part
    wanted = max(1, OVER_FIELDS // len(PARTS))
    while statuses.total() < wanted:
        conversation = Conversation(client, number)
        try:
            conversation.hold()
        except AssertionError as broken:
            raise AssertionError(f"conversation {number}: {broken}") from broken
        statuses += conversation.statuses
        number += len(PARTS)
    if wanted > 100:
        planned = sum(count for (path, _), count in statuses.items() if path == "trajectories")
        assert statuses["trajectories", "200"] > 0.4 * planned, statuses


def test_a_task_that_wants_all_memory_fails_one_test_and_names_its_request(
    client: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such a request once took 22 GB, with the process of the tests."""
    before = resource.getrlimit(resource.RLIMIT_DATA)

    def wants_all(work: Any) -> Any:
        return np.ones((4096, 2**20))

    for name in ("plan_trajectory", "check_collisions"):
        monkeypatch.setitem(TASKS, name, wants_all)
    with pytest.raises(AssertionError, match=r'(?s)"robot": .*memory_exceeded'):
        Conversation(client, 0).hold()
    assert resource.getrlimit(resource.RLIMIT_DATA) == before
