"""Learnt durations of requests: robust to outliers, separate for each client, and bounded."""

from __future__ import annotations

import pytest

from api.pool.costs import (
    KNOWN_CLIENTS,
    KNOWN_KINDS_OF_CLIENT,
    REMEMBERED,
    TRIAL_PAUSE,
    Cost,
    Costs,
    Kind,
)

KIND = Kind(("plan", "cubic"), 2)


def test_costs_are_learnt_by_kind_and_size() -> None:
    costs = Costs()
    kind = Kind(("plan", "cubic"), 4)
    assert costs.expected(kind) is None
    costs.learn(kind, 0.02)
    assert costs.expected(kind) == Cost(0.02, 0.01)
    assert costs.expected(kind._replace(size=6)) == Cost(0.08, 0.04)  # four times as many waypoints
    assert costs.expected(Kind(("plan", "min_effort"), 4)) is None
    for _ in range(100):
        costs.learn(kind, 0.05)
    learnt = costs.expected(kind)
    assert learnt is not None
    assert learnt.mean == pytest.approx(0.05, rel=1e-3)
    assert learnt.is_cheap
    costs.learn(kind, 0.001, is_bound=True)  # a refusal says nothing of what a plan takes
    assert costs.expected(kind) == learnt


def test_outliers_do_not_change_an_estimate_and_a_change_does() -> None:
    """One time-out of 60 s made plans of 20 ms look like 37 s."""
    costs = Costs()
    for _ in range(REMEMBERED):
        costs.learn(KIND, 0.02)
    for _ in range(REMEMBERED // 4):
        costs.learn(KIND, 60.0, is_bound=True)
    estimate = costs.expected(KIND)
    assert estimate is not None
    assert estimate.most < 0.1
    for _ in range(REMEMBERED // 2):
        costs.learn(KIND, 60.0, is_bound=True)
    estimate = costs.expected(KIND)
    assert estimate is not None
    assert estimate.mean > 30.0


def test_what_one_client_sends_says_nothing_of_anothers_requests() -> None:
    costs = Costs()
    costs.learn(KIND, 0.02, "victim")
    for _ in range(REMEMBERED):
        costs.learn(KIND, 60.0, "attacker", is_bound=True)
    found = [costs.expected(KIND, client) for client in ("victim", "attacker", "stranger")]
    assert [cost and cost.mean for cost in found] == [0.02, 60.0, 60.0]


def test_trials_are_seldom() -> None:
    costs = Costs()
    for client in ("a", "b"):
        times = [k / 10.0 for k in range(1000) if costs.claim_trial(KIND, client, k / 10.0)]
        assert times == [k * TRIAL_PAUSE for k in range(10)]
    assert costs.expected(KIND, "a") is None  # a trial by itself says nothing


def test_no_more_is_kept_than_a_client_cannot_overflow() -> None:
    costs = Costs()
    for k in range(2 * KNOWN_CLIENTS):
        for size in range(2 * KNOWN_KINDS_OF_CLIENT):
            costs.learn(Kind(("plan",), size), 1.0, str(k))
    assert len(costs._of_client) == KNOWN_CLIENTS
    assert {len(histories) for histories in costs._of_client.values()} == {KNOWN_KINDS_OF_CLIENT}
