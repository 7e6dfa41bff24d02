"""What is told of a batch: how far it is, how fast, and what came of it."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from api.batches.items import PLANNED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from api.database.batches import BatchRecord, Outcomes


def described(batch: BatchRecord, outcomes: Sequence[Outcomes]) -> dict[str, Any]:
    """Write a batch as the schema `Batch` says."""
    counts = {found.outcome: found.items for found in outcomes}
    waiting, planned = counts.pop(None, 0), counts.pop(PLANNED, 0)
    rate = batch.rate if batch.status == "running" else None
    return {
        **_dated(batch),
        "counts": {"total": batch.total, "waiting": waiting, "planned": planned, "refused": sum(counts.values())},
        "rate": rate,
        "remaining_time": waiting / rate if rate else None,
        "summary": {
            "duration": _durations([found for found in outcomes if found.outcome == PLANNED]),
            "refusals": [{"code": code, "count": count} for code, count in counts.items()],
            "worst_ratio": max((found.ratio for found in outcomes if found.ratio is not None), default=None),
        },
    }


def listed(batch: BatchRecord) -> dict[str, Any]:
    """Write a batch as the schema `BatchEntry` says."""
    return {**_dated(batch), "total": batch.total}


def finished(description: dict[str, Any]) -> int:
    """Count the requests of a described batch that have been answered."""
    counts: dict[str, int] = description["counts"]
    return counts["total"] - counts["waiting"]


def _dated(batch: BatchRecord) -> dict[str, Any]:
    ended = None if batch.ended is None else _date(batch.ended)
    return {"id": batch.id, "status": batch.status, "created": _date(batch.created), "ended": ended}


def _date(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds")


def _durations(planned: Sequence[Outcomes]) -> dict[str, float] | None:
    for found in planned:
        if found.shortest is not None and found.longest is not None and found.sum is not None:
            return {"shortest": found.shortest, "mean": found.sum / found.items, "longest": found.longest}
    return None
