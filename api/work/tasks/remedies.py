"""Remedies that the service would accept: within the schema of the request, and with an answer that it writes."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import orjson

from api.base.errors import InvalidRequest
from api.base.json_pointers import NothingThere, changed
from api.base.size import rows_of
from api.work.answers.problem_documents import pointer_of
from api.work.answers.values import value_answer
from api.work.tasks.context import to_json, validated
from planner.errors import InvalidProblem, PlanningError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from api.work.tasks.context import TaskContext
    from planner import FieldPath
    from planner.errors import Remedy


@contextmanager
def acceptable_remedies(context: TaskContext, request: Any, dof: int) -> Iterator[None]:
    """Leave the changes of a refusal that make the request one which the service takes.

    A change beyond the bounds of the schema vanishes, with all its parts. One with which the answer would
    have too many rows, or with which nobody has tried to plan, is a hint.

    Args:
        context: The task under way; its body is the request.
        request: The request in it.
        dof: The number of joints of its robot.
    """
    try:
        yield
    except PlanningError as refusal:
        beyond = {
            way_of(change)
            for change in (*refusal.remedies, *refusal.hints)
            if not _fits(change, context, type(request))
        }
        remedies = [remedy for remedy in refusal.remedies if way_of(remedy) not in beyond]
        hints = [hint for hint in refusal.hints if way_of(hint) not in beyond]
        refusal.remedies = tuple(remedy for remedy in remedies if _is_answered(remedy, context, request, dof))
        refusal.hints = (*hints, *(remedy for remedy in remedies if remedy not in refusal.remedies))
        raise


@contextmanager
def at_back_end(index: int) -> Iterator[None]:
    """Let refusals about the back end point to one back end of a comparison."""

    def moved(field: FieldPath) -> FieldPath:
        return ("backends", index, *field[1:]) if field[0] == "backend" else field

    try:
        yield
    except PlanningError as refusal:
        refusal.remedies = tuple(replace(remedy, field=moved(remedy.field)) for remedy in refusal.remedies)
        refusal.hints = tuple(replace(hint, field=moved(hint.field)) for hint in refusal.hints)
        if isinstance(refusal, InvalidProblem):
            refusal.faults = tuple(fault._replace(field=moved(fault.field)) for fault in refusal.faults)
        raise


def way_of(remedy: Remedy) -> str:
    """Name the way that a change is a part of: durations help together, so do limits, and payloads."""
    for name in ("duration", "limits", "payload"):
        if name in remedy.field:
            return name
    return pointer_of(remedy.field)


def _fits(remedy: Remedy, context: TaskContext, schema: Any) -> bool:
    """Tell whether the request with a change follows its schema."""
    value = orjson.loads(to_json(value_answer(remedy.value)))
    try:
        validated(schema, changed(context.document, pointer_of(remedy.field), value), context.caps)
    except (NothingThere, InvalidRequest):  # it may lead into a stored scene
        return False
    return True


def _is_answered(remedy: Remedy, context: TaskContext, request: Any, dof: int) -> bool:
    if remedy.duration is None:
        return False
    return rows_of(remedy.duration, request.sample_period) * dof <= context.caps.max_samples
