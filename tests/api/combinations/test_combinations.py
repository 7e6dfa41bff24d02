"""Plans of requests that combine all that the schema offers: each answer holds by the words of its request alone."""

from __future__ import annotations

from functools import cache
from itertools import combinations, islice, product
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.api.combinations.covering import Covering, Factor
from tests.api.combinations.factors import factors, refused
from tests.api.combinations.made import Combined, robots
from tests.api.made_up_service import made_up_service
from tests.api.random_requests.conversation import Judged
from tests.sizes import NAME

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx

    from tests.api.combinations.covering import Row

PARTS = range(8)
ROWS = {"quick": 8, "large": 16}
"""Number of rows that are tried by the name of the size, the first of which hold most pairs; a soak tries all."""

DRAWS = 3
"""Number of times that numbers are drawn for a row until its request is planned."""


@cache
def rows() -> list[Row]:
    return list(islice(Covering(factors(), refused()).rows(), ROWS.get(NAME)))


@pytest.fixture(scope="module")
def client() -> Iterator[httpx.Client]:
    with made_up_service() as client:
        for _, bodies in robots().values():
            for body in bodies:
                added = client.post("/v1/robots", json=body)
                assert added.status_code == 201, added.text
        yield client


def test_every_pair_occurs_that_is_not_refused() -> None:
    """By brute force, with a factor that is there only beside a level of another one."""
    made = [Factor("a", "xyz"), Factor("b", "xy"), Factor("c", "xyz", {"b": ["y"]}), Factor("d", "xy")]
    rows = list(Covering(made, [{"a": ["x"], "d": ["x"]}]).rows())
    assert not any(row["a"] == row["d"] == "x" for row in rows)
    assert all(("c" in row) == (row["b"] == "y") for row in rows)
    for one, other in combinations(made, 2):
        for levels in product(one.levels, other.levels):
            pair = dict(zip((one.name, other.name), levels, strict=True))
            is_there = any(pair.items() <= row.items() for row in rows)
            assert is_there == (pair not in ({"a": "x", "d": "x"}, *({"b": "x", "c": level} for level in "xyz"))), pair


@pytest.mark.sized
@pytest.mark.parametrize("part", PARTS)
def test_plans_are_what_their_requests_say(client: httpx.Client, part: int) -> None:
    """In a soak every pair of what the schema offers occurs; most requests are planned."""
    chosen = rows()[part :: len(PARTS)]
    known, planned = robots(), 0
    for number, row in enumerate(chosen):
        for draw in range(DRAWS):
            random = np.random.default_rng([part, number, draw])
            robot = known[row["robot"]][0]
            answer, _ = Judged(client, robot, random).ask("trajectories", Combined(robot, row, random).request())
            if answer is not None:
                planned += 1
                break
    if len(chosen) > 50:
        assert planned > 0.6 * len(chosen)
