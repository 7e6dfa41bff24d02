"""The agent that follows remedies: its requests are refused at first, and remedies change the named fields."""

from __future__ import annotations

from collections import Counter

import pytest

from benchmarks.service.agents import changed, infeasible_requests, measure


def test_every_request_is_refused_as_it_is() -> None:
    figures = measure(12)
    assert figures["requests"] == 12
    assert 1 not in figures["calls"]
    assert sum(figures["calls"].values()) == figures["planned"] > 6


def test_the_reasons_take_turns() -> None:
    kinds = Counter(kind for kind, _ in infeasible_requests(12))
    assert set(kinds.values()) == {2}


@pytest.mark.parametrize(
    ("change", "value", "expected"),
    [
        ("/a/1/b", 3, {"a": [0, {"b": 3}]}),
        ("/a/0", 5, {"a": [5, {"b": 2}]}),
        ("/c~1d", 1, {"a": [0, {"b": 2}], "c/d": 1}),
        ("/e/f", 1, {"a": [0, {"b": 2}], "e": {"f": 1}}),
        ("/a", None, {}),
    ],
)
def test_a_remedy_changes_the_field_it_names(change: str, value: object, expected: object) -> None:
    assert changed({"a": [0, {"b": 2}]}, {"change": change, "value": value}) == expected
