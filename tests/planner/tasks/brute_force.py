"""The shortest order of few tasks by dynamic programming over all sets of tasks, without the code of the planner."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, product
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

Positions = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Choice:
    """Ways to carry out a task: the joint positions of each, the rules of the task and its tool."""

    ways: tuple[Positions, ...]
    after: tuple[int, ...] = ()
    group: str | None = None
    tool: str | None = None


def joint_times(starts: np.ndarray, ends: np.ndarray, limits: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return the least times (starts, ends) from rest to rest: trapezoids, or triangles below full speed."""
    velocity, acceleration = limits
    travel = np.abs(starts[:, None] - ends)
    triangle = 2.0 * np.sqrt(travel / acceleration)
    times = np.where(travel * acceleration > velocity**2, travel / velocity + velocity / acceleration, triangle)
    found: np.ndarray = times.max(axis=2)
    return found


def shortest(
    start: Sequence[float],
    choices: Sequence[Choice],
    end: Sequence[float] | None,
    limits: tuple[np.ndarray, np.ndarray],
    changeable: Mapping[str, Positions] = MappingProxyType({}),
) -> float:
    """Return the least duration of all allowed orders and ways; infinite: the rules allow none.

    A tool is taken on the way through the joint positions of its holder, and put back on the way back through them.
    Without one the robot starts, and ends if there is an end.
    """
    count = len(choices)
    entries = [np.array([way[0] for way in choice.ways]) for choice in choices]
    exits = [np.array([way[-1] for way in choice.ways]) for choice in choices]
    inner = [
        np.array(
            [sum(joint_times(np.array([a]), np.array([b]), limits)[0, 0] for a, b in pairwise(way)) for way in each]
        )
        for each in (choice.ways for choice in choices)
    ]

    def travel(starts: np.ndarray, ends: np.ndarray, left: str | None, taken: str | None) -> np.ndarray:
        ways = () if left == taken else (changeable.get(left or "", ())[::-1], changeable.get(taken or "", ()))
        stops = [np.array([position]) for way in ways for position in way]
        found = joint_times(starts, stops[0] if stops else ends, limits)
        for a, b in pairwise([*stops, ends] if stops else []):
            found = found + joint_times(a, b, limits)
        return found

    tools = [choice.tool for choice in choices]
    between = {
        (a, b): travel(exits[a], entries[b], tools[a], tools[b]) + inner[b] for a in range(count) for b in range(count)
    }

    def may_follow(done: int, last: int | None, task: int) -> bool:
        if done >> task & 1 or any(not done >> other & 1 for other in choices[task].after):
            return False
        group = None if last is None else choices[last].group
        left = [k for k, other in enumerate(choices) if other.group == group and not done >> k & 1]
        return group is None or not left or choices[task].group == group

    best: dict[tuple[int, int], np.ndarray] = {}
    for task in range(count):
        if may_follow(0, None, task):
            best[1 << task, task] = travel(np.array([start]), entries[task], None, tools[task])[0] + inner[task]
    for done in range(1, 1 << count):
        for last, task in product(range(count), range(count)):
            if (done, last) in best and may_follow(done, last, task):
                totals = (best[done, last][:, None] + between[last, task]).min(axis=0)
                key = done | 1 << task, task
                best[key] = np.minimum(best.get(key, np.inf), totals)
    whole = [(last, totals) for (done, last), totals in best.items() if done == (1 << count) - 1]
    homewards = [
        0.0 if end is None else travel(exits[last], np.array([end]), tools[last], None)[:, 0] for last, _ in whole
    ]
    return min((float((t + home).min()) for (_, t), home in zip(whole, homewards, strict=True)), default=np.inf)


def contour_ways(positions: Positions) -> tuple[Positions, ...]:
    """Return a closed contour from every entry in both directions."""
    count = len(positions)
    rounds = [tuple(positions[(first + k) % count] for k in range(count + 1)) for first in range(count)]
    return tuple(way[::step] for way, step in product(rounds, (1, -1)))
