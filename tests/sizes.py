"""How much the tests try: `TEST_SIZE` is `quick` (for people), `large` (for CI) or `soak` (for a release).

The tests whose size this is are those with the marks `hypothesis` or `random`; `LARGER` selects them.
"""

import os
from typing import NamedTuple


class Size(NamedTuple):
    """How much is tried.

    Attributes:
        requests: Random requests a back end that its promises are held against, a tenth of them along paths.
        examples: Cases of every other property, unless the test names a number of its own.
        http: Made-up HTTP requests an operation.
        jobs_every: Of how many jobs of the corpus' suite one is planned.
    """

    requests: int
    examples: int
    http: int
    jobs_every: int


SIZES = {"quick": Size(100, 100, 15, 3), "large": Size(1_000, 500, 40, 1), "soak": Size(5_000, 2_000, 150, 1)}
NAME = os.environ.get("TEST_SIZE", "quick")
SIZE = SIZES[NAME]
LARGER = "hypothesis or random"
