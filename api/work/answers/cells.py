"""Answers for cells of several robots."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from api.store.contents.digests import request_hash
from api.work.answers.plans import AnswerOptions, as_dict

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from api.contract.cells import CellRequest
    from planner.cells import CellPlan


def options_of_plans(request: CellRequest, definitions: Mapping[str, bytes]) -> list[AnswerOptions]:
    """Make the options of the answer of each robot's plan.

    Args:
        request: The request, whose hash each plan quotes.
        definitions: The definitions of its added robots by their ids.
    """
    of_robots = b"\n".join(definitions[name] for name in sorted(definitions))
    quoted = request_hash(request, of_robots or None)
    return [AnswerOptions(own.sample_period, frozenset(own.include), 1, quoted) for own in request.robots]


def cell_as_dict(cell: CellPlan, options: Sequence[AnswerOptions]) -> dict[str, Any]:
    """Return the answer as plain values and numpy arrays."""
    members = zip(cell.names, cell.unhindered, cell.waits, cell.plans, options, strict=True)
    return {
        "duration": cell.duration,
        "robots": [
            {"name": name, "duration_alone": alone, "waits": waits, "plan": as_dict(plan, own)}
            for name, alone, waits, plan, own in members
        ],
        "clearances": [{"robots": between.movers, "clearance": vars(between.clearance)} for between in cell.clearances],
        "meetings": [vars(meeting) for meeting in cell.meetings],
    }
