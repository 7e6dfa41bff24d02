"""The agent that follows remedies: its requests are refused at first, and remedies change the named fields."""

from __future__ import annotations

from collections import Counter

import pytest

from benchmarks.service.agents import infeasible_requests, measure


@pytest.mark.large_only
def test_every_request_is_refused_as_it_is() -> None:
    figures = measure(6)
    assert figures["requests"] == 6
    assert 1 not in figures["calls"]
    assert sum(figures["calls"].values()) == figures["planned"] > 3


def test_the_reasons_take_turns() -> None:
    kinds = Counter(kind for kind, _ in infeasible_requests(12))
    assert set(kinds.values()) == {2}
