"""Cost keys of operations: few values that predict the duration of a request."""

from __future__ import annotations

from typing import Any

import pytest

from api.contract.parts.backends import backend_schemas
from api.contract.parts.free_motions import may_have_free_motions
from api.http.cost_keys import (
    BACKENDS,
    by_cell,
    by_plan,
    by_plan_of,
    by_roadmap,
    by_size,
    kind_of,
)
from api.pool.costs import CHEAP, Costs, Kind


def kind_of_plan(document: dict[str, Any], size: int = 0) -> Kind:
    return kind_of("plan_trajectory", document, by_plan, size)


def test_a_large_request_says_little_of_small_ones() -> None:
    """150,000 points and one minute are no reason to refuse a plan of 300 bytes."""
    costs = Costs()
    document = {"backend": {"kind": "cubic"}, "waypoints": [{}, {}]}
    costs.learn(kind_of_plan(document, size=3_000_000), 60.0, is_bound=True)
    expected = costs.expected(kind_of_plan(document, size=300))
    assert expected is not None
    assert expected.mean < CHEAP


def test_bodies_of_clients_make_few_kinds() -> None:
    """60 refused requests, each with a back end that nobody knows, left 3.9 GB in the server."""
    names = ["x" * k for k in range(2000)]
    documents = [{"backend": {"kind": name, name: True}, "waypoints": [{"motion": {"kind": name}}]} for name in names]
    kinds = {kind_of_plan(document) for document in documents}
    assert len(kinds) == 1
    budgets = [{"optimise": True, "time_budget": 10.0**k} for k in range(-300, 300)]
    kinds = {kind_of_plan({"waypoints": [{"motion": budget}]}) for budget in budgets}
    assert len(kinds) < 30


def test_the_kinds_of_back_ends_are_those_that_there_are() -> None:
    assert set(BACKENDS) == set(backend_schemas())


@pytest.mark.parametrize(
    "document",
    [
        {},
        {"backend": 7, "waypoints": 3, "poses": {}},
        {"backend": {"kind": [1]}, "waypoints": [1, {"motion": 2}, {"motion": {"kind": []}}]},
        {"backends": [], "positions": [[]]},
        {"backends": [{"kind": {}}], "backend": None},
        {"robots": 1},
        {"robots": [1, {"waypoints": [{"motion": {"kind": []}}], "backend": 1}, {}]},
        {"samples": [600], "waypoints": [{"motion": {"kind": {}}}]},
        {"samples": 1e300},
    ],
)
def test_the_kind_of_what_follows_no_schema(document: dict[str, Any]) -> None:
    assert not may_have_free_motions(document)
    for cost_key in (by_size, by_plan, by_plan_of(0), by_cell, by_roadmap):
        assert hash(kind_of("plan_trajectory", document, cost_key)) is not None


def test_the_kind_says_what_makes_a_request_long() -> None:
    def kind(**document: Any) -> Kind:
        return kind_of_plan({"backend": {"kind": "toppra"}, "waypoints": [{}] * 5, **document})

    kinds = {
        kind(),
        kind(backend={"kind": "cubic"}),
        kind(backend={"kind": "toppra", "jerk_limited": True}),
        kind(waypoints=[{}] * 50),
        kind(waypoints=[{}] * 4 + [{"motion": {"kind": "linear"}}]),
    }
    assert len(kinds) == 5
    assert kind(waypoints=[{}] * 6, seed=3) == kind()


def test_the_kinds_of_a_comparison_are_those_of_its_back_ends() -> None:
    document = {"backends": [{"kind": "cubic"}, {"kind": "toppra"}], "waypoints": [{}]}
    kinds = [kind_of("compare_backends", document, by_plan_of(index)) for index in range(3)]
    assert [kind.family[1] for kind in kinds] == [("cubic",), ("toppra",), ()]


def test_only_the_size_tells_the_kind_where_no_plan_is_made() -> None:
    document = {"backend": {"kind": "toppra"}, "positions": [[0.0]] * 5}
    assert kind_of("forward_kinematics", document, by_size) == Kind(("forward_kinematics",), 3)
