"""Rules of orders beside all permutations."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

import planner
from planner.tasks.rules import Rules, rule_faults

WHERE = [planner.JointWaypoint([0.0, 0.0])]


def drawn_tasks(random: np.random.Generator, count: int) -> list[planner.Task]:
    """Draw tasks with rules that often follow from each other, and sometimes contradict each other."""
    pairs = np.triu(random.random((count, count)) < 0.4, 1) | (random.random((count, count)) < 0.02)
    np.fill_diagonal(pairs, val=False)
    groups = [str(group) if group < 2 else None for group in random.integers(0, 5, count)]
    names = [str(k) for k in random.permutation(count)]
    return [
        planner.Task(WHERE, names[k], after=[names[other] for other in np.flatnonzero(pairs[:, k])], group=groups[k])
        for k in range(count)
    ]


def is_kept(tasks: list[planner.Task], order: tuple[int, ...]) -> bool:
    """Tell whether an order keeps all rules as they are written."""
    places = {tasks[index].name: place for place, index in enumerate(order)}
    groups = [tasks[index].group for index in order]
    begun = [group for k, group in enumerate(groups) if group and (k == 0 or groups[k - 1] != group)]
    precede = all(places[name] < places[task.name] for task in tasks for name in task.after)
    return precede and len(begun) == len(set(begun))


@pytest.mark.parametrize("seed", range(12))
def test_rules_allow_the_orders_that_keep_all_of_them(seed: int) -> None:
    random = np.random.default_rng(seed)
    tasks = drawn_tasks(random, 6)
    kept = {order for order in permutations(range(6)) if is_kept(tasks, order)}
    assert bool(kept) == (not list(rule_faults(tasks)))
    rules = Rules.of(tasks)
    if kept:
        assert {order for order in permutations(range(6)) if rules.allow(np.array(order))} == kept
    found = {tuple(rules.ordered(range(6), lambda following: int(random.choice(following)))) for _ in range(100)}
    assert {order for order in found if len(order) == 6} <= kept


def test_a_rule_that_follows_from_others_is_left_out() -> None:
    tasks = [planner.Task(WHERE, str(k), after=[str(other) for other in range(k)]) for k in range(40)]
    assert len(Rules.of(tasks).before) == 39
