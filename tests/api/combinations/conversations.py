"""Rows of factors as conversations with a service, each answer before the judges."""

from __future__ import annotations

from functools import cache
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from tests.api.combinations.covering import Covering
from tests.api.combinations.factors import BROKEN_ONCE, COUNT, NONE, factors, plain_factors, refused
from tests.api.combinations.made import Combined
from tests.api.random_requests.conversation import Judged

if TYPE_CHECKING:
    import httpx

    from planner.robots import Robot
    from tests.api.combinations.covering import Row
    from tests.api.combinations.made import Known

DRAWS = 3
"""Number of times that numbers are drawn for a row until its request is planned."""

SHARES = (0.92, 1.02)
"""Durations of the whole that are requested, one after the other, as shares of the duration without any.

A back end that is not time-optimal has to hurry for the first; the second leaves hardly any time.
"""


@cache
def pairs(count: int | None) -> list[Row]:
    """Return the first rows that combine every pair of levels; None: all."""
    return list(islice(Covering(factors(), refused()).rows(), count))


@cache
def triples(count: int | None) -> list[Row]:
    """Return the first rows that combine every triple inside a group, with plain other factors; None: all.

    What else a row has may hide a fault of three levels, or refuse the request before it shows.
    """
    chosen = plain_factors()
    groups = {factor.group for factor in chosen if factor.group}
    return list(islice(Covering(chosen, refused(), groups).rows(BROKEN_ONCE), count))


def add_robots(client: httpx.Client, known: Known) -> None:
    """Add the robots of the factor to a service."""
    for _, bodies in known.values():
        for body in bodies:
            added = client.post("/v1/robots", json=body)
            assert added.is_success, added.text


def is_planned(client: httpx.Client, known: Known, row: Row, seed: list[int]) -> bool:
    """Tell whether the request of a row is finally planned; the judges fail where an answer is wrong."""
    robot = known[row["robot"]][0]
    return any(_is_planned(client, robot, row, np.random.default_rng([*seed, draw])) for draw in range(DRAWS))


def _is_planned(client: httpx.Client, robot: Robot, row: Row, random: np.random.Generator) -> bool:
    """Plan without durations, then with segment durations, then with a whole duration near the answered one."""
    judged, combined = Judged(client, robot, random), Combined(robot, row, random)
    request = combined.request()
    answer, _ = judged.ask("trajectories", request)
    if answer is not None and any(row.get(f"timing {k}", NONE) != NONE for k in range(COUNT)):
        request = combined.with_times_of_segments(request, answer)
        answer, _ = judged.ask("trajectories", request)
    if answer is None or not combined.has("duration"):
        return answer is not None
    durations = (share * answer["duration"] for share in SHARES)
    return any(judged.ask("trajectories", request | {"duration": whole})[0] is not None for whole in durations)
