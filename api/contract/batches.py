"""Batches: many plan requests at once, and their results."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from api.contract.answers import PlanAnswer  # noqa: TC001 - pydantic evaluates the annotations
from api.contract.parts.common import Answer, Schema
from api.contract.parts.problem_documents import ProblemDocument  # noqa: TC001
from api.contract.requests import PlanRequest  # noqa: TC001

MOST_VARIED = 16
"""The most fields that a grid varies."""

MOST_REQUESTS = 1_000_000
"""The most requests that the schemas allow; the service's own cap (GET /v1/limits) is narrower."""


class VariedField(Schema):
    """A field of the template that takes one value after the other."""

    pointer: Annotated[str, Field(pattern="^(/[^/]*)+$", max_length=200)]
    """Where the field is, as a JSON pointer (RFC 6901) into the template. The template may leave out the field, and the
    objects of a plan request around it: `/limits/velocity_scale` needs no `limits` there."""
    values: Annotated[list[Any], Field(min_length=1, max_length=MOST_REQUESTS)]
    """The values that it takes, in the unit of the field."""


class Grid(Schema):
    """One request for each combination of values; the last field varies first."""

    template: dict[str, Any]
    """A plan request (`PlanRequest`), all of whose other fields stay as they are."""
    vary: Annotated[list[VariedField], Field(min_length=1, max_length=MOST_VARIED)]
    """The fields that are varied."""


class BatchRequest(Schema):
    """Plan requests: a list of them, or a grid."""

    requests: Annotated[list[PlanRequest], Field(min_length=1, max_length=MOST_REQUESTS)] | None = None
    """The requests; the results have the faults of each."""
    grid: Grid | None = None
    """A grid of requests, in place of the list."""


class BatchCounts(Answer):
    """The progress of a batch."""

    total: int
    """The number of its requests."""
    waiting: int
    """The number of requests that have not been answered yet; a cancelled batch answers no more."""
    planned: int
    """The number of requests that have a plan."""
    refused: int
    """The number of requests that have a problem."""


class DurationSummary(Answer):
    """The durations of the trajectories of a batch."""

    shortest: float
    """The shortest, s."""
    mean: float
    """The mean of all, s."""
    longest: float
    """The longest, s."""
    histogram: list[int]
    """The number of trajectories in each of 20 equal parts from the shortest duration to the longest."""


class RefusalCount(Answer):
    """The number of requests that were refused for one reason."""

    code: str
    """The code of the problem."""
    count: int
    """The number of requests."""
    example: int
    """The index of one of them, counted from 0; `results?limit=1&cursor=` with the number before it has its problem
    document."""


class BatchSummary(Answer):
    """The outcomes of the requests so far."""

    duration: DurationSummary | None
    """The durations of the trajectories; null: there is none."""
    refusals: list[RefusalCount]
    """The problems, by their codes."""
    worst_ratio: float | None
    """The largest share of a limit that any trajectory uses, 1 is all of it and its unit is 1; null: none has one."""


class Batch(Answer):
    """A batch."""

    id: str
    """The id of the batch."""
    status: Literal["running", "completed", "cancelled"]
    """Whether there is work left to do (`running`), all is done (`completed`), or it was given up (`cancelled`)."""
    created: str
    """When it arrived (RFC 3339)."""
    ended: str | None
    """When it was completed or cancelled (RFC 3339); null: it is running."""
    counts: BatchCounts
    """The progress."""
    rate: float | None
    """The number of requests that are answered in a second now; null: unknown, or it has ended."""
    remaining_time: float | None
    """An estimate of the time that is left, s; null: unknown, or it has ended."""
    summary: BatchSummary
    """The durations, refusals and ratios so far."""


class BatchEntry(Answer):
    """A batch in a list."""

    id: str
    """The id of the batch."""
    status: Literal["running", "completed", "cancelled"]
    """As in the batch itself."""
    created: str
    """When it arrived (RFC 3339)."""
    ended: str | None
    """When it was completed or cancelled (RFC 3339); null: it is running."""
    total: int
    """The number of its requests."""


class BatchesAnswer(Answer):
    """A page of the batches that are kept."""

    batches: list[BatchEntry]
    """The batches, the newest first."""
    next_cursor: str | None
    """The `cursor` of the next page; null: this is the last."""


class BatchResult(Answer):
    """The outcome of one request of a batch."""

    index: int
    """The index of the request in the batch, counted from 0."""
    status: str
    """`planned`, or the code of the problem."""
    duration: float | None = None
    """With `planned`: the duration of the trajectory, s."""
    trajectory: PlanAnswer | None = None
    """With `planned`, and the format `json`: the answer that the request alone would get."""
    content: str | None = None
    """With `planned`, and any other format: the answer that the request alone would get."""
    media_type: str | None = None
    """The media type of `content`."""
    encoding: Literal["text", "base64"] | None = None
    """How `content` is written: as it is, or, where it is no text, in base64."""
    problem: ProblemDocument | None = None
    """The problem document that the request gets in place of a trajectory."""


class BatchResultsAnswer(Answer):
    """A page of the results of a batch, in the order of its requests."""

    results: list[BatchResult]
    """The results; a running batch has results up to the first request that has not been answered yet."""
    next_cursor: str | None
    """The `cursor` of the next results, which may not be planned yet; null: the batch has ended, and this is all."""
