"""The requests in the body of a batch: a list, a grid, or one a line; each comes with its pointer."""

from __future__ import annotations

import itertools
import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from api.base.errors import ServiceError, invalid, invalid_at
from api.base.json_pointers import NothingThere, changed, steps_of
from api.base.size import parse_json, refuse_many_rows
from api.contract import batches as schemas
from api.contract.requests import PlanRequest
from api.work.tasks.context import validated

if TYPE_CHECKING:
    from collections.abc import Iterator

    from api.work.tasks.context import TaskContext

ESCAPED = re.compile(rb"\\.", re.DOTALL)
"""An escaped character in a string."""

STEPS = {ord("["): 1, ord("{"): 1, ord("]"): -1, ord("}"): -1}
"""The change of the depth in a document by a character."""


def of_lines(body: bytes, first: int) -> Iterator[tuple[Any, str]]:
    """Find the requests of a body with one a line, or of a piece of it, from this index on."""
    lines = (line for line in body.split(b"\n") if line.strip())
    return ((parse_json(line, f"/requests/{index}"), f"/requests/{index}") for index, line in enumerate(lines, first))


def of_document(context: TaskContext, most: int) -> Iterator[tuple[Any, str]]:
    """Find the requests of a body that is one document, with a list of them or a grid."""
    body = context.task.body
    refuse_many_rows(body, context.arguments.get("most_bytes", len(body)))
    document, objects = _without_objects(body)
    if isinstance(document, dict):  # what is null counts as left out
        document = {name: value for name, value in document.items() if value is not None}
    match document:
        case {"requests": list(requests), **more} if requests and not more:
            if sum(isinstance(request, dict) for request in requests) != len(objects):
                raise invalid_at("/requests", "must be given once; got it twice")
            return _put_back(requests, objects)
        case {"grid": grid, **more} if not more:
            try:
                return _combinations(validated(schemas.Grid, grid, context.caps), most)
            except ServiceError as error:
                faults = error.details["errors"]
                raise invalid([fault | {"pointer": "/grid" + fault["pointer"]} for fault in faults]) from None
        case _:
            raise invalid_at("", "The body must have non-empty `requests` or a `grid`, and nothing else.")


def _without_objects(body: bytes) -> tuple[Any, list[bytes]]:
    """Parse a document with `{}` in the place of each object of its lists; return these as bytes.

    A parser needs twelve times the length of its text, and its values take as much as the body again. So 100,000
    requests are too much for a worker, and each is written down again as soon as it is read.
    """
    characters = np.frombuffer(ESCAPED.sub(b"__", body) if b"\\" in body else body, np.uint8)
    steps = np.array([STEPS.get(code, 0) for code in range(256)], np.int8)[characters]
    steps[np.cumsum(characters == ord('"'), dtype=np.uint8) % 2 == 1] = 0  # in a string
    places = np.flatnonzero(steps)
    opens, depth = steps[places] > 0, np.cumsum(steps[places], dtype=np.int64)
    ends = np.flatnonzero(~opens & (depth == 2))
    begins = np.flatnonzero(opens & (depth == 3))[: len(ends)]
    holders = np.flatnonzero(opens & (depth == 2))
    holders = holders[np.searchsorted(holders, begins) - 1] if len(begins) else begins
    of_lists = (characters[places[begins]] == ord("{")) & (characters[places[holders]] == ord("["))
    edges = np.stack([places[begins], places[ends] + 1], axis=-1)[of_lists].ravel().tolist()
    rest = b"{}".join(body[i:j] for i, j in zip([0, *edges[1::2]], [*edges[::2], len(body)], strict=True))
    return parse_json(rest, ""), [body[i:j] for i, j in zip(edges[::2], edges[1::2], strict=True)]


def _put_back(requests: list[Any], objects: list[bytes]) -> Iterator[tuple[Any, str]]:
    left = iter(objects)
    for index, request in enumerate(requests):
        pointer = f"/requests/{index}"
        yield parse_json(next(left), pointer) if isinstance(request, dict) else request, pointer


def _combinations(grid: schemas.Grid, most: int) -> Iterator[tuple[Any, str]]:
    """Make the requests of a grid; all have the template's pointer.

    Raises:
        InvalidRequest: There are too many, or a plan request has no such field.
    """
    number = math.prod(len(field.values) for field in grid.vary)
    if number > most:
        message = f"must have at most {most} combinations; got {number}"
        raise invalid_at("/vary", message)
    for k, field in enumerate(grid.vary):
        try:
            steps = steps_of(field.pointer)
            if len(steps) > 1 and steps[0] not in PlanRequest.model_fields:
                raise NothingThere
            changed(grid.template, field.pointer, None)
        except NothingThere:
            raise invalid_at(f"/vary/{k}/pointer", "must lead to a field of a plan request") from None
    return _varied(grid.template, grid.vary)


def _varied(template: Any, vary: list[schemas.VariedField]) -> Iterator[tuple[Any, str]]:
    """Put each combination of values into the template.

    Raises:
        InvalidRequest: A value of one field takes away what another pointer leads into.
    """
    for combination in itertools.product(*(field.values for field in vary)):
        request = template
        for k, (field, value) in enumerate(zip(vary, combination, strict=True)):
            try:
                request = changed(request, field.pointer, value)
            except NothingThere:
                message = "must lead to a field of the template, whatever the values of the other varied fields"
                raise invalid_at(f"/grid/vary/{k}/pointer", message) from None
        yield request, "/grid/template"
