"""The requests of batches on their way from a body into the database. Light to import: server and workers do."""

from __future__ import annotations

import zlib
from typing import NamedTuple

LEVEL = 6
"""The effort of compression, without unit, 1 to 9: zlib's own choice. A request takes some 20 microseconds."""

READ_ITEMS, RENDER_RESULTS, REPORT = "create_batch", "get_batch_results", "get_batch_report"
"""The names of the tasks that take requests out of a body, write results in the requested form, and write a report."""

PLAN_ITEMS = "plan_batch_items"
"""The name of the task of workers that plan requests."""

CHUNK_SECONDS = 0.05
"""The time that the requests of one chunk should take, s: many times the cost of handing them over, and a short wait
for others."""

CHUNK_BYTES = 2**18
"""The most bytes of requests and their scenes that a worker reads before it plans the first of them, without that one.
Some hundred requests have as many, or a fair one, which takes many times as much memory once it has been read."""

PLANNED = "planned"
"""The outcome of an item that has a plan; all others are codes of problems."""


class NewItem(NamedTuple):
    """A request as it is put into a batch.

    Attributes:
        request: The request as JSON, compressed.
        robot: The id of the robot that it names, if it names one.
        scene: The id of the scene that it names, if it names one.
        deadline: The deadline that it asks, s.
        may_be_free: Whether it may have free motions, which a roadmap of the robot in the scene helps to find.
    """

    request: bytes
    robot: str | None
    scene: str | None
    deadline: float
    may_be_free: bool = False


class Result(NamedTuple):
    """What came of an item, to be read.

    Attributes:
        position: Its position in its batch.
        request: The request as JSON, compressed.
        robot: The digest of the added robot that it names; None: another one, or none.
        scene: The digest of the scene that it names; None: none.
        outcome: `planned`, or the code of a problem.
        result: The saved plan, or the problem document, compressed.
        duration: The duration of the trajectory, s; None: there is none.
        roadmap: The digest of the roadmap on which its free motions are searched; None: there is none.
    """

    position: int
    request: bytes
    robot: str | None
    scene: str | None
    outcome: str
    result: bytes
    duration: float | None
    roadmap: str | None = None


def compressed(content: bytes) -> bytes:
    """Make a request or a problem document smaller, about a third of its size."""
    return zlib.compress(content, LEVEL)


def decompressed(content: bytes) -> bytes:
    """Read what `compressed` made."""
    return zlib.decompress(content)
