"""Plans of requests that combine all that the schema offers: each answer holds by the words of its request alone."""

from __future__ import annotations

import json
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np
import pytest

from api.contract.requests import PlanRequest
from tests.api.combinations.conversations import add_robots, is_planned, pairs, triples
from tests.api.combinations.covering import Covering, Factor
from tests.api.combinations.factors import COUNT, factors, refused
from tests.api.combinations.fields import LEFT_OUT, fields_in, fields_of_schema
from tests.api.combinations.made import Combined, robots
from tests.api.made_up_service import made_up_service
from tests.sizes import NAME

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx

PARTS = range(2 if NAME == "quick" else 4)
PAIRS = {"quick": 2, "large": 6}
TRIPLES = {"quick": 2, "large": 12}
"""Numbers of tried rows by the name of the size; a soak tries all."""


@pytest.fixture(scope="module")
def client() -> Iterator[httpx.Client]:
    with made_up_service() as client:
        add_robots(client, robots())
        yield client


def test_every_pair_occurs_that_is_not_refused() -> None:
    """By brute force, with a factor that exists only beside a level of another factor."""
    made = [Factor("a", "xyz"), Factor("b", "xy"), Factor("c", "xyz", {"b": ["y"]}), Factor("d", "xy")]
    rows = list(Covering(made, [{"a": ["x"], "d": ["x"]}]).rows())
    assert not any(row["a"] == row["d"] == "x" for row in rows)
    assert all(("c" in row) == (row["b"] == "y") for row in rows)
    for one, other in combinations(made, 2):
        for levels in product(one.levels, other.levels):
            pair = dict(zip((one.name, other.name), levels, strict=True))
            is_there = any(pair.items() <= row.items() for row in rows)
            assert is_there == (pair not in ({"a": "x", "d": "x"}, *({"b": "x", "c": level} for level in "xyz"))), pair


def test_every_triple_of_a_group_occurs_that_is_not_refused() -> None:
    made = [Factor(name, "xyz", group="one") for name in "abcd"] + [Factor("e", "xy", group="two"), Factor("f", "xy")]
    first = {"a": "y", "b": "z"}
    rows = list(Covering(made, [{"a": ["x"], "d": ["x"]}], {"one", "two"}).rows([first]))
    assert first.items() <= rows[0].items()
    for names in combinations("abcd", 3):
        for levels in product("xyz", repeat=3):
            triple = dict(zip(names, levels, strict=True))
            is_there = any(triple.items() <= row.items() for row in rows)
            assert is_there != (triple.get("a") == triple.get("d") == "x"), triple


def test_every_field_of_the_schema_is_in_some_request() -> None:
    """A new field of the schema belongs in the factors, or in `LEFT_OUT` with a reason."""
    chosen = [factor.name for factor in factors() if factor.name[-1] not in "023"]  # those of waypoint 1 and the whole
    times = [{"index": k, "choice": "given", "arrival_time": k, "departure_time": k} for k in range(COUNT)]
    found = set[str]()
    for row in Covering(factors(), refused()).each_level(chosen):
        combined = Combined(robots()[row["robot"]][0], row, np.random.default_rng(0))
        request = combined.with_times_of_segments(combined.request(), {"waypoints": times})
        request |= {"duration": 9.0} if combined.has("duration") else {}
        found |= {*fields_in(PlanRequest.model_validate_json(json.dumps(request)))}
    assert fields_of_schema() - found == {*LEFT_OUT}


@pytest.mark.sized
@pytest.mark.parametrize("part", PARTS)
def test_plans_are_what_their_requests_say(client: httpx.Client, part: int) -> None:
    """In a soak every pair of levels occurs; most requests are planned."""
    chosen = pairs(PAIRS.get(NAME))[part :: len(PARTS)]
    planned = sum(is_planned(client, robots(), row, [part, number]) for number, row in enumerate(chosen))
    if len(chosen) > 50:
        assert planned > 0.6 * len(chosen)


@pytest.mark.sized
@pytest.mark.parametrize("part", PARTS)
def test_plain_plans_are_what_their_requests_say(client: httpx.Client, part: int) -> None:
    """In a soak every triple of goals and motions occurs, and every triple of back ends, durations and transitions."""
    chosen = triples(TRIPLES.get(NAME))[part :: len(PARTS)]
    planned = sum(is_planned(client, robots(), row, [part, number]) for number, row in enumerate(chosen))
    if len(chosen) > 50:
        assert planned > 0.6 * len(chosen)
