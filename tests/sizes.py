"""Numbers of test cases: `TEST_SIZE` is `quick` (for people), `large` (for CI) or `soak` (for a release).

The sizes apply to tests with the marks `hypothesis`, `sized`, `long_table` or `large_only`;
`LARGER` selects them.
"""

import os
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np


class Size(NamedTuple):
    """Numbers of test cases.

    Attributes:
        requests: Random requests per back end that check its promises, a tenth of them along paths.
        examples: Cases of every other property, unless the test names a number of its own.
        http: Made-up HTTP requests per operation.
        over_fields: Random HTTP requests over the fields of plans and operations, whose answers are judged.
        one_in: Number of corpus jobs, and of cases of long tables, per tried one.
    """

    requests: int
    examples: int
    http: int
    over_fields: int
    one_in: int


SIZES = {
    "quick": Size(8, 15, 0, 8, 20),
    "large": Size(60, 30, 4, 150, 1),
    "soak": Size(5_000, 2_000, 150, 50_000, 1),
}
NAME = os.environ.get("TEST_SIZE", "quick")
SIZE = SIZES[NAME]
HTTP = int(os.environ.get("TEST_HTTP", SIZE.http))
"""Made-up HTTP requests per operation, set by `TEST_HTTP`: 1,670 give 100,000 in all, with chains."""
OVER_FIELDS = int(os.environ.get("TEST_FIELDS", SIZE.over_fields))
"""Random requests over the fields, set by `TEST_FIELDS`."""

LARGER = "hypothesis or sized or long_table or large_only"


def diagonal(*columns: Iterable[Any]) -> list[tuple[Any, ...]]:
    """Return rows that contain every value of every column, instead of all combinations of the values."""
    values = [list(column) for column in columns]
    return [tuple(column[row % len(column)] for column in values) for row in range(max(map(len, values)))]


def chosen_rows(count: int) -> set[int]:
    """Choose one in `one_in` rows of a long table at random, the same rows each time."""
    return set(np.random.default_rng(count).permutation(count)[: -(-count // SIZE.one_in)].tolist())
